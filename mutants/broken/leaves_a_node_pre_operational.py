"""Forgets to start the last of its nodes."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("01_boot.configured", "operational")


@instead_of(DriveNode, "start_operation")
def break_controller(start: Original, self: DriveNode) -> None:
    if self.name != "stretch":
        start(self)
