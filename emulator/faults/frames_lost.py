"""Frames that never arrive: a loose connector, a full queue."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.frame_fault import FrameFault
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.frames import Carry, Disturbance, Frame


class Lost:
    """Goes no further."""

    def meet(self, frame: Frame, carry: Carry) -> None:
        """Nothing: the frame is gone."""


@dataclass(frozen=True)
class FramesLost(FrameFault):
    """Frames between a drive and the bus are lost, SYNC among those received."""

    name: ClassVar[str] = "frames_lost"

    def disturbance(self, virtual: VirtualMachine, axis: int) -> Disturbance:
        return Lost()
