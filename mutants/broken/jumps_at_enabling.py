"""Lets drives follow set-point 0, wherever the axis is."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller import motion
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("03_homing.home", "no_jump")


@instead_of(motion, "follow")
def break_controller(follow: Original, cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    for drive in drives:
        drive.setpoint = 0
    follow(cycle, drives)
