"""Leaves it to the drives to watch whether axes follow, and a drive knows the set-points alone that have come to it."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.setpoints_late", "outcome")


def break_controller() -> None:
    leave_out(supervision.following_error)
