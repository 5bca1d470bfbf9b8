"""Forgets to start the last of its nodes."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("01_boot.configured", "operational")


def break_controller() -> None:
    start = DriveNode.start_operation

    def broken(self: DriveNode) -> None:
        if self.name != "stretch":
            start(self)

    replace(DriveNode, "start_operation", broken)
