"""Faults of drives, bus and machine, on request: one fault per file, found by `drivetwin.emulator.faults.library`."""
