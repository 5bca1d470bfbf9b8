"""A weak supply: the DC-link voltage drops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Number, Parameter
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class Undervoltage(LastingFault):
    """The DC link is too low: an enabled drive coasts in a fault with EMCY 3220h, bit 4 of its statusword falls."""

    name: ClassVar[str] = "undervoltage"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        NODE,
        Number("level", "DC link voltage, in nominal ones; the drive's limit is 0.6", "", 0.0, 0.59),
    )

    level: float = 0.5

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        hardware = virtual.drives[axis].hardware
        hardware.dc_link_voltage = self.level * hardware.nominal_voltage

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        hardware = virtual.drives[axis].hardware
        hardware.dc_link_voltage = hardware.nominal_voltage
