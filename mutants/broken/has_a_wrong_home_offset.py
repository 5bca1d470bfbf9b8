"""Assumes that the lift's switch is half a millimetre higher than it is."""

from __future__ import annotations

from drivetwin.controller.machine import Axis
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import misdescribed

CAUGHT_BY = CaughtBy("03_homing.home", "homed")


@misdescribed("lift")
def break_controller(axis: Axis) -> Axis:
    return axis.model_copy(update={"homing": axis.homing.model_copy(update={"switch_position": 0.0005})})
