"""Supervises whether drives answer, but neither what they report nor whether they follow."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.undervoltage", "stopped")


def break_controller() -> None:
    leave_out(supervision.emergency, supervision.left_operation, supervision.without_voltage, supervision.following_error)
