"""The front panel in the browser: a client of the bus and of the control socket, like any other."""
