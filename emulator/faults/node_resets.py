"""A drive that restarts by itself: a watchdog, or a dip of its 24 V supply."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.parameter import NODE, Parameter
from drivetwin.emulator.faults.restart import OFF, restart
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class NodeResets(Fault):
    """A drive restarts: no torque, all of its memory but what is stored is lost, its homing too, and it sends its boot-up."""

    name: ClassVar[str] = "node_resets"
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE, OFF)

    off: float = 0.05

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        restart(virtual, axis, self.off)
