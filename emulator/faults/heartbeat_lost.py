"""A node that works but whose heartbeat is missing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.canopen.heartbeat import BASE_COB_ID
from drivetwin.emulator.faults.base import LastingFault
from drivetwin.emulator.faults.frames_lost import Lost
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.emulator.wire.choice import EveryNth
from drivetwin.emulator.wire.frames import Direction, Selective


@dataclass(frozen=True)
class HeartbeatLost(LastingFault):
    """Heartbeats of a drive stay away, and with them what has the same COB-ID: answers to node guarding, boot-up."""

    name: ClassVar[str] = "heartbeat_lost"

    def befall(self, virtual: VirtualMachine, axis: int) -> None:
        wire = virtual.wires[axis]
        wire.disturb(Direction.SENT, self, Selective(BASE_COB_ID + wire.device.node_id, EveryNth(1), Lost()))

    def leave(self, virtual: VirtualMachine, axis: int) -> None:
        virtual.wires[axis].mend(self)
