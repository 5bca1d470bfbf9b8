"""A drive that still streams but no longer answers SDO requests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.canopen.sdo_server import REQUEST_COB_ID
from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.frames_lost import Lost
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.choice import EveryNth
from drivetwin.emulator.wire.frames import Direction, Selective


@dataclass(frozen=True)
class SdoSilent(LastingFault):
    """A drive's SDO server neither acts nor answers; NMT, PDO and heartbeat go on."""

    name: ClassVar[str] = "sdo_silent"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        wire = virtual.wires[axis]
        wire.disturb(Direction.RECEIVED, self, Selective(REQUEST_COB_ID + wire.device.node_id, EveryNth(1), Lost()))

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.wires[axis].mend(self)
