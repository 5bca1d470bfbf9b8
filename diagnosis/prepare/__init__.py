"""Recordings made ready: checked, filtered and differentiated once, on one simulation, with what they can be asked."""
