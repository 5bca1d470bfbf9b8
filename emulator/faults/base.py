"""The base of a fault: a name, parameters, how it strikes a virtual machine, and how it ends if it lasts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.parameter import ALL, NODE, Parameter
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError


@dataclass(frozen=True)
class Fault(ABC):
    """One thing that goes wrong. Subclasses are frozen dataclasses whose fields are the parameters; the machine has the state.

    `node` is the node-ID of the machine's file, the axis's name, or `all`.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE,)

    node: int | str

    def axes(self, virtual: VirtualMachine) -> tuple[int, ...]:
        """Numbers of the axes that it strikes. Raises UserError for a node that the machine has not."""
        axes = virtual.machine.axes
        meant = [
            number for number, (name, axis) in enumerate(axes.items()) if self.node in (ALL, name, axis.node_id)
        ]
        if not meant:
            nodes = ", ".join(f"{axis.node_id} ({name})" for name, axis in axes.items())
            raise UserError(f"{self.name}: {virtual.machine.machine} has no node {self.node!r}; it has {nodes}, or say {ALL}")
        return tuple(meant)

    def strike(self, virtual: VirtualMachine) -> None:
        """Let it happen now. Raises UserError for a node that the machine has not."""
        for axis in self.axes(virtual):
            self.befall(virtual, axis)

    def end(self, virtual: VirtualMachine) -> None:
        """Take its cause away, as only a LastingFault can. Raises UserError for one of an instant."""
        raise UserError(f"{self.name} strikes once and has no end; leave out how long it lasts")

    @abstractmethod
    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        """Let it happen to one axis, by its number."""


class LastingFault(Fault):
    """A fault whose cause stays until `end`."""

    def end(self, virtual: VirtualMachine) -> None:
        for axis in self.axes(virtual):
            self.leave(virtual, axis)

    @abstractmethod
    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        """Take its cause from one axis, by its number; nothing, where it is not there."""
