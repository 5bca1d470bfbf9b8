"""A drive that fails permanently: its control supply is gone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class NodeDies(Fault):
    """A drive is dead: no torque, its brake engaged, nothing on the bus; only a power cycle brings it back."""

    name: ClassVar[str] = "node_dies"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.switch_off(axis)
