"""Goes on streaming whatever drives tell, or do not tell."""

from __future__ import annotations

from controller import supervision
from mutants.base import CaughtBy
from mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stopped")


def break_controller() -> None:
    leave_out(*supervision.CHECKS)
