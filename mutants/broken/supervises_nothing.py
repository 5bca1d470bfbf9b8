"""Continues streaming, whatever the drives report or do not report."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stopped")


def break_controller() -> None:
    leave_out(*supervision.CHECKS)
