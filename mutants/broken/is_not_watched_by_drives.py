"""Lets no drive supervise the controller, neither by heartbeat nor by SYNC."""

from __future__ import annotations

from drivetwin.controller import bring_up, error_control
from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.controller_killed", "stays_disabled")


@instead_of(bring_up, "set_error_control")
def break_controller(_original: Original, drive: DriveNode) -> None:
    drive.write(round(error_control.NODE_BEATS_EVERY * 1e3), 0x1017)
