"""Recordings: what they hold, how they are read and written, and how the files of others become some."""
