"""A drive that refuses to write an object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.canopen.sdo_server import REQUEST_COB_ID, RESPONSE_COB_ID
from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.parameter import NODE, Parameter, Whole
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.faulty_wire import FaultyWire
from drivetwin.emulator.wire.frames import Carry, Direction, Frame

INITIATE_DOWNLOAD = 1
"""Client command specifier (CiA 301, 7.2.4.3.3)."""

ABORT_TRANSFER = 0x80


@dataclass(frozen=True)
class SdoRefused(LastingFault):
    """A drive aborts each write of an object by SDO and keeps its value; all else is obeyed and answered."""

    name: ClassVar[str] = "sdo_refused"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        NODE,
        Whole("index", "of the object", 0x1000, 0xFFFF, hexadecimal=True),
        Whole("subindex", "of the object", 0x00, 0xFF, hexadecimal=True),
        Whole("code", "abort code (CiA 301, table 22)", 0x0000_0000, 0xFFFF_FFFF, hexadecimal=True),
    )

    index: int
    subindex: int = 0
    code: int = 0x0800_0022
    """Because of the present device state."""

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        wire = virtual.wires[axis]
        place = self.index.to_bytes(2, "little") + bytes((self.subindex,))
        wire.disturb(Direction.RECEIVED, self, _Refusal(wire, place, self.code.to_bytes(4, "little")))

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.wires[axis].mend(self)


@dataclass(frozen=True)
class _Refusal:
    """Answers a write of the object at `place` (index, subindex, as in an SDO frame) by an abort, and carries on all else."""

    wire: FaultyWire
    place: bytes
    code: bytes

    def meet(self, frame: Frame, carry: Carry) -> None:
        node = self.wire.device.node_id
        asked = frame.cob_id == REQUEST_COB_ID + node and len(frame.data) == 8 and frame.data[0] >> 5 == INITIATE_DOWNLOAD
        if asked and frame.data[1:4] == self.place:
            self.wire.transmit(RESPONSE_COB_ID + node, bytes((ABORT_TRANSFER,)) + self.place + self.code)
        else:
            carry(frame)
