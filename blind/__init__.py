"""The blind test of the diagnosis: machines whose effects are withheld, a sealed key, a score."""
