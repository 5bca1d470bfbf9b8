"""Motions that distinguish what a recording could not: one per file, chosen by what a report left open."""
