"""The controller: brings up the drives, moves the axes, captures and identifies; knows only the bus and its own model."""
