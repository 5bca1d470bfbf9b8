"""An active touch-probe input: a workpiece, or a short circuit to another wire."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.drive.hardware import ALWAYS, NEVER
from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Parameter, Whole
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class ProbeInput(LastingFault):
    """The input of touch probe 1 or 2 is actuated: bit 16 or 17 of 60FDh, and an edge for 60B8h where it begins and ends."""

    name: ClassVar[str] = "probe_input"
    parameters: ClassVar[tuple[Parameter, ...]] = (NODE, Whole("probe", "which of the two", 1, 2))

    probe: int

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].hardware.probes[self.probe - 1] = ALWAYS

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].hardware.probes[self.probe - 1] = NEVER
