"""Frames that arrive twice: a repeating gateway, or a sender that missed an acknowledgement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.frame_fault import FrameFault
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.frames import Carry, Disturbance, Frame


class Doubled:
    """Goes on, and once more."""

    def meet(self, frame: Frame, carry: Carry) -> None:
        """Carry it on twice."""
        carry(frame)
        carry(frame)


@dataclass(frozen=True)
class FramesDoubled(FrameFault):
    """Frames between a drive and the bus come twice, right after each other."""

    name: ClassVar[str] = "frames_doubled"

    def disturbance(self, virtual: VirtualMachine, axis: int) -> Disturbance:
        return Doubled()
