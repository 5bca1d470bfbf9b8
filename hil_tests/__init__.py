"""The acceptance suite: a controller, any program on a bus, against a virtual machine, requirement by requirement."""
