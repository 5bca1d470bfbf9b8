"""The virtual machine's bus as copper of a bit rate: its frames arbitrate, take their length, queue, and are late."""

from emulator.copper.bus import CopperBus, Watch
from emulator.copper.lockstep import LockstepCopper
from emulator.copper.realtime import RealtimeCopper

COPPER: dict[str, type[CopperBus]] = {"realtime": RealtimeCopper, "sync": LockstepCopper}
"""By the name of the machine's clock (`emulator.clock.CLOCKS`)."""

__all__ = ["COPPER", "CopperBus", "LockstepCopper", "RealtimeCopper", "Watch"]
