"""Sets no limit of the following error, neither its own nor the drive's."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.following_error", "following_error_limited")


def break_controller() -> None:
    def broken(self: DriveNode, distance: float) -> None:
        """None is set."""

    replace(DriveNode, "limit_following_error", broken)
