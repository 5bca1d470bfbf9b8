"""A drive that returns with another node-ID: a replacement whose node-ID was not set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.parameter import NODE, Parameter, Whole
from drivetwin.emulator.faults.restart import OFF, restart
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class NodeChangesId(Fault):
    """A drive restarts with another node-ID, until its next power cycle."""

    name: ClassVar[str] = "node_changes_id"
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE, Whole("new_id", "the node-ID that it has then", 1, 127), OFF)

    new_id: int
    off: float = 0.05

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        restart(virtual, axis, self.off, self.new_id)
