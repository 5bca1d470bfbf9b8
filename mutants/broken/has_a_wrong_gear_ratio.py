"""Scales stretch by a gear ratio of 51 : 1 instead of 50 : 1."""

from __future__ import annotations

from drivetwin.controller.machine import Axis
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import misdescribed

CAUGHT_BY = CaughtBy("04_moves.single", "final_position")


@misdescribed("stretch")
def break_controller(axis: Axis) -> Axis:
    return axis.model_copy(update={"gear": (51, 1)})
