"""Lets drives follow set-point 0, wherever the axis stands."""

from __future__ import annotations

from collections.abc import Sequence

from controller import motion
from controller.cycle import Cycle
from controller.drive_node import DriveNode
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("03_homing.home", "no_jump")


def break_controller() -> None:
    follow = motion.follow

    def broken(cycle: Cycle, drives: Sequence[DriveNode]) -> None:
        for drive in drives:
            drive.setpoint = 0
        follow(cycle, drives)

    replace(motion, "follow", broken)
