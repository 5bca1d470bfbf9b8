"""The machine's main switch or one drive's plug: off and on again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.parameter import ALL, NODE, Parameter
from drivetwin.emulator.faults.restart import OFF, restart
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class PowerCycle(Fault):
    """Drives lose their supply and get it back: as after power-on, homing lost; axes coast or are held by their brakes."""

    name: ClassVar[str] = "power_cycle"
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE, OFF)

    node: int | str = ALL
    off: float = 0.5

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        restart(virtual, axis, self.off)
