"""Frames that arrive late: a gateway, a busy bus, a slow driver."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.timing import TOLERANCE
from drivetwin.emulator.faults.frame_fault import FRAME_PARAMETERS, FrameFault
from drivetwin.emulator.faults.parameter import Number, Parameter
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.frames import Carry, Disturbance, Frame


class Late:
    """Holds frames for `delay` [s] of simulated time, and lets them go at the end of the cycle in which it is over."""

    def __init__(self, virtual: VirtualMachine, delay: float) -> None:
        alarms: Alarms = virtual.alarms
        self._now = virtual.now
        self._delay = delay
        self._held: deque[tuple[float, Frame, Carry]] = deque()
        self._alarm = alarms.add(self._release)

    def meet(self, frame: Frame, carry: Carry) -> None:
        """Hold it."""
        self._held.append((self._now() + self._delay, frame, carry))
        self._alarm.set(self._held[0][0])

    def _release(self, now: float) -> None:
        while self._held and self._held[0][0] - TOLERANCE <= now:
            _, frame, carry = self._held.popleft()
            carry(frame)
        if self._held:
            self._alarm.set(self._held[0][0])


@dataclass(frozen=True)
class FramesLate(FrameFault):
    """Frames between a drive and the bus come late; those that are not chosen overtake them."""

    name: ClassVar[str] = "frames_late"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *FRAME_PARAMETERS,
        Number("delay", "how late, in simulated time, rounded up to whole communication cycles", "s", 0.0, 10.0),
    )

    delay: float = 0.002

    def disturbance(self, virtual: VirtualMachine, axis: int) -> Disturbance:
        return Late(virtual, self.delay)
