"""What the services share about time. Their only clock is `now()`, simulated seconds."""

TOLERANCE = 1e-9
"""Simulated time is a sum of floats: a deadline is met when it is this close [s]."""
