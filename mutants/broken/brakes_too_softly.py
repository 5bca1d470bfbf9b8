"""Sets a quick stop that takes ten times as long."""

from __future__ import annotations

from controller.drive_node import DriveNode
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.heartbeat_lost", "stopped")


def break_controller() -> None:
    write = DriveNode.write

    def broken(self: DriveNode, value: float, index: int, subindex: int = 0) -> None:
        write(self, round(0.1 * value) if index == 0x6085 else value, index, subindex)

    replace(DriveNode, "write", broken)
