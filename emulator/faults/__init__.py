"""What goes wrong with drives, bus and machine, on request: one fault a file, found by `drivetwin.emulator.faults.library`."""
