"""A blocked axis: a part has fallen into its guide."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.virtual_machine import VirtualMachine

TIMES_PEAK = 10.0
"""Friction of a jam, in peak torques of the motor through its gear."""


@dataclass(frozen=True)
class Jam(LastingFault):
    """An axis stops dead and stays: friction of ten times what its motor can give at its peak."""

    name: ClassVar[str] = "jam"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        driven = list(virtual.machine.axes.values())[axis]
        virtual.plant.incidents.rub(axis, self, TIMES_PEAK * driven.motor.peak_torque * driven.gear_ratio, 0.0)

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.plant.incidents.smooth(axis, self)
