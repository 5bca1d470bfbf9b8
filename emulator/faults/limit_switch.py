"""A limit switch that is active although the axis is not there: a broken wire of a normally closed contact."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import ClassVar

from drivetwin.emulator.drive.hardware import Hardware
from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Parameter, Word
from drivetwin.emulator.virtual_machine import VirtualMachine

NEGATIVE, POSITIVE = "negative", "positive"


@dataclass(frozen=True)
class LimitSwitch(LastingFault):
    """A limit switch is actuated everywhere: motion towards it is a fault with EMCY 5442h (negative) or 5443h (positive)."""

    name: ClassVar[str] = "limit_switch"
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE, Word("side", "which of the two", (NEGATIVE, POSITIVE)))

    side: str

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        hardware = virtual.drives[axis].hardware
        everywhere = {"low": inf} if self.side == NEGATIVE else {"high": -inf}
        hardware.switches = replace(hardware.switches, **everywhere)

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        hardware = virtual.drives[axis].hardware
        sound = Hardware.of(list(virtual.machine.axes.values())[axis]).switches
        mended = {"low": sound.low} if self.side == NEGATIVE else {"high": sound.high}
        hardware.switches = replace(hardware.switches, **mended)
