"""Broken controllers that the acceptance suite must reject: the suite's own test. Nothing imports this package."""
