"""Moves rotate faster than the machine may."""

from __future__ import annotations

from drivetwin.controller.machine import Axis
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import misdescribed

CAUGHT_BY = CaughtBy("04_moves.whole_travel", "limits")


@misdescribed("rotate")
def break_controller(axis: Axis) -> Axis:
    return axis.model_copy(update={"max_speed": 1.25 * axis.max_speed})
