"""Weighs sets of effects by how well they predict, given coloured noise and a smooth unknown."""
