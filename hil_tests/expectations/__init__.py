"""What a scenario may expect, one kind a file: of the bus, of the plant, of time."""
