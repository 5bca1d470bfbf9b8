"""Safe torque off (IEC 61800-5-2, 4.2.3.2): the hardware takes the torque away, whatever the drive wants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class Sto(LastingFault):
    """Safe torque off is requested: an enabled drive coasts in a fault with EMCY 5441h, and no reset helps while it lasts."""

    name: ClassVar[str] = "sto"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].hardware.sto = True

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].hardware.sto = False
