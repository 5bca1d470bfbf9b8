"""An encoder that gives no signal: a broken cable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class EncoderLoss(LastingFault):
    """The count stands still; an enabled drive coasts in a fault with EMCY 7305h."""

    name: ClassVar[str] = "encoder_loss"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].hardware.encoder_alive = False

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.drives[axis].hardware.encoder_alive = True
