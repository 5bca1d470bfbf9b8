"""Frequency response of an axis and its loops from excited motion: estimate, split into loops, judge margins, propose gains."""
