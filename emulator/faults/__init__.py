"""What goes wrong between a drive and its bus: bus off, error passive, lost frames; injected, not simulated."""

from emulator.faults.loss import EveryNth, Loss, WithProbability
from emulator.faults.wire import FaultyWire

__all__ = ["EveryNth", "FaultyWire", "Loss", "WithProbability"]
