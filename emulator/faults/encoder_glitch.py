"""One wrong sample of an encoder: a disturbed word on its line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.drive.servo import encoder_quantum
from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.parameter import NODE, Parameter, Whole
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class EncoderGlitch(Fault):
    """One sample is off, the last of the coming communication cycle, which a TPDO at the next SYNC tells."""

    name: ClassVar[str] = "encoder_glitch"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        NODE,
        Whole("increments", "how far off, in encoder increments, either sign", -(2**31), 2**31 - 1),
    )

    increments: int

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        encoder = list(virtual.machine.axes.values())[axis].encoder
        virtual.plant.incidents.misread(axis, self.increments * encoder_quantum(encoder.increments_per_revolution))
