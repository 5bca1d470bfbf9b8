"""Frames with wrong data but a valid CRC, corrupted before the CAN controller, which therefore cannot detect it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random
from typing import ClassVar

from drivetwin.emulator.faults.frame_fault import FRAME_PARAMETERS, FrameFault
from drivetwin.emulator.faults.parameter import Parameter, Whole
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.frames import Carry, Disturbance, Frame


class Corrupted:
    """Flips some bits of the data, drawn by a generator of its own."""

    def __init__(self, bits: int, seed: int) -> None:
        self._bits = bits
        self._random = Random(seed)

    def meet(self, frame: Frame, carry: Carry) -> None:
        """Carry it on with other data; a frame without data as it is."""
        room = 8 * len(frame.data)
        number = int.from_bytes(frame.data, "little")
        for bit in self._random.sample(range(room), min(self._bits, room)):
            number ^= 1 << bit
        carry(replace(frame, data=number.to_bytes(len(frame.data), "little")))


@dataclass(frozen=True)
class FramesCorrupted(FrameFault):
    """Frames between a drive and the bus have wrong data, undetected by CAN."""

    name: ClassVar[str] = "frames_corrupted"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        *FRAME_PARAMETERS,
        Whole("bits", "how many bits of the data are flipped; which, is drawn by `seed`", 1, 64),
    )

    bits: int = 1

    def disturbance(self, virtual: VirtualMachine, axis: int) -> Disturbance:
        return Corrupted(self.bits, self.seed + axis)
