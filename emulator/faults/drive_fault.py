"""A fault that a drive finds by itself, whatever its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.parameter import NODE, Parameter, Whole
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class DriveFault(Fault):
    """A drive tells an error code (603Fh, EMCY) and stops by 605Eh, or coasts where the code means that there is no torque."""

    name: ClassVar[str] = "drive_fault"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        NODE,
        Whole("code", "of CiA 402-2, such as 0x2310 overcurrent, 0x4210 temperature", 0x1000, 0xFFFF, hexadecimal=True),
    )

    code: int

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].fault(self.code)
