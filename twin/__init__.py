"""A model as the twin of a machine: what was found about the machine is written into it, and it moves as the machine moved."""
