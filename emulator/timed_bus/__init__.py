"""The virtual machine's bus with bit timing: its frames arbitrate, take time, queue, and arrive late."""

from drivetwin.emulator.timed_bus.bus import TimedBus, Watch
from drivetwin.emulator.timed_bus.lockstep import LockstepBus
from drivetwin.emulator.timed_bus.realtime import RealtimeBus

TIMED_BUSES: dict[str, type[TimedBus]] = {"realtime": RealtimeBus, "sync": LockstepBus}
"""By the name of the machine's clock (`drivetwin.emulator.clock.CLOCKS`)."""

__all__ = ["TIMED_BUSES", "LockstepBus", "RealtimeBus", "TimedBus", "Watch"]
