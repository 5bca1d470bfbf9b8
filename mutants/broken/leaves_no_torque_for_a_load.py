"""Limits the torque of the lift to what the machine needs without a load."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.payload", "outcome")

EMPTY = 320.0
"""Force with which the lift accelerates its own mass upwards [N]."""


@instead_of(Session, "configure")
def break_controller(configure: Original, self: Session, drives: Sequence[DriveNode]) -> None:
    configure(self, drives)
    for drive in drives:
        if drive.name == "lift":
            drive.write(round(1000.0 * EMPTY / drive.joint_torque(drive.rated_torque)), 0x6072)
