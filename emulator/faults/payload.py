"""A mass that appears suddenly: a workpiece picked up, or forgotten."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Number, Parameter
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class Payload(LastingFault):
    """A point mass rides on the outermost body that the axis moves, at that body's centre of mass; speeds stay as they are."""

    name: ClassVar[str] = "payload"
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE, Number("mass", "of the load", "kg", 0.0, 1e4))

    mass: float

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.plant.incidents.load(axis, self, self.mass)

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.plant.incidents.unload(axis, self)
