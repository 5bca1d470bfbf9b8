"""Bit timing: the bits of a frame on a physical bus, the load that frames make, and which of them waits."""
