"""Torque feed-forward: from the identified model, and learned over repetitions."""
