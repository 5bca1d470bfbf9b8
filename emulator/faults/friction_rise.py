"""A failing bearing: its friction rises while the machine runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Number, Parameter
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class FrictionRise(LastingFault):
    """Coulomb friction, and stiction with it, rises in proportion to time by a torque at the joint, and stays there."""

    name: ClassVar[str] = "friction_rise"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        NODE,
        Number("torque", "how much it rises, at the joint", "N·m or N", 0.0, 1e6),
        Number("over", "how long it takes to rise; 0: at once", "s", 0.0, 1e5),
    )

    torque: float
    over: float = 1.0

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.plant.incidents.rub(axis, self, self.torque, self.over)

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.plant.incidents.smooth(axis, self)
