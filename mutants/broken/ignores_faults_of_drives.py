"""Watches whether drives answer, and neither what they tell of themselves nor whether they follow."""

from __future__ import annotations

from controller import supervision
from mutants.base import CaughtBy
from mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.undervoltage", "stopped")


def break_controller() -> None:
    leave_out(supervision.emergency, supervision.left_operation, supervision.without_voltage, supervision.following_error)
