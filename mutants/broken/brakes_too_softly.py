"""Sets a quick stop that takes ten times as long."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.heartbeat_lost", "stopped")


@instead_of(DriveNode, "write")
def break_controller(write: Original, self: DriveNode, value: float, index: int, subindex: int = 0) -> None:
    write(self, round(0.1 * value) if index == 0x6085 else value, index, subindex)
