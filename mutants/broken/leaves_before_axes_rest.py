"""Exits once no drive has voltage, while a braking axis still moves others."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller import stop
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.setpoints_late", "disabled_at_end")


@instead_of(stop, "_still_moving")
def break_controller(_original: Original, _cycle: Cycle, _drives: Sequence[DriveNode]) -> list[DriveNode]:
    return []
