"""Notices neither that an axis does not follow nor that its motor is at its torque limit."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out, replace

CAUGHT_BY = CaughtBy("08_faults.following_error", "stopped")


def break_controller() -> None:
    def broken(self: DriveNode, distance: float) -> None:
        """None is set."""

    replace(DriveNode, "limit_following_error", broken)
    leave_out(supervision.jammed)
