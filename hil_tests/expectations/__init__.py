"""What a scenario may expect of the bus, the plant and of time; one kind per file."""
