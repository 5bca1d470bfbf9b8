"""A drive whose CAN controller has left the bus after too many errors (ISO 11898-1, fault confinement)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.virtual_machine import VirtualMachine


@dataclass(frozen=True)
class BusOff(LastingFault):
    """A drive is off the bus and reacts as its 1029h and 6007h say; when it is back it tells EMCY 8140h."""

    name: ClassVar[str] = "bus_off"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.wires[axis].bus_off()

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.wires[axis].recover()
