"""A model as the twin of a machine: what was found of the machine written into it, and the model moved as the machine was."""
