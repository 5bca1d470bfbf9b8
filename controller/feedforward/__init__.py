"""Torque told to the drives beside the motion: from the identified model, and learned over repetitions."""
