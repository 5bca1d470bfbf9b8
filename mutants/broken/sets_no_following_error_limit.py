"""Sets no limit of the following error, neither its own nor the drive's."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.following_error", "following_error_limited")


@instead_of(DriveNode, "limit_following_error")
def break_controller(_original: Original, self: DriveNode, distance: float) -> None:
    """None is set."""
