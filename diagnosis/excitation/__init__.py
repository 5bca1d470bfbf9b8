"""Motions that tell apart what a recording could not: one a file, chosen by what a report left open."""
