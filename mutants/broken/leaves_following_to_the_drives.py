"""Leaves the following error to the drives, and a drive knows only the set-points that have reached it."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.setpoints_late", "outcome")


def break_controller() -> None:
    leave_out(supervision.following_error)
