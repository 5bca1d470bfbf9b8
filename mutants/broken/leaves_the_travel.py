"""Moves to any target, without checking where the axes are."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.controller.tasks import move
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out, replace

CAUGHT_BY = CaughtBy("04_moves.out_of_travel", "limits")


def break_controller() -> None:
    def broken(*_arguments: object) -> None:
        """Every target will do."""

    replace(move, "check_target", broken)
    leave_out(supervision.outside_travel)
