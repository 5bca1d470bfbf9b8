"""What goes wrong with drives, bus and machine, on request: one fault a file, found by `emulator.faults.library`."""

from emulator.faults.wire import FaultyWire

__all__ = ["FaultyWire"]
