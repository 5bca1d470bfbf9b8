"""Takes the place where each axis was switched on for its zero."""

from __future__ import annotations

from collections.abc import Sequence

from controller.drive_node import DriveNode
from controller.session import Session
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("03_homing.home", "homed")


def break_controller() -> None:
    def broken(_session: Session, drives: Sequence[DriveNode]) -> None:
        for drive in drives:
            drive.homed = True

    replace(Session, "home", broken)
