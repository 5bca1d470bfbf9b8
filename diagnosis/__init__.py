"""Where the gap between a simulation and a machine's recordings lies, what causes it, how far it shrinks."""
