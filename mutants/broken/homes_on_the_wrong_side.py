"""Homes rotate at the positive limit switch, and treats it as the negative one."""

from __future__ import annotations

from drivetwin.controller.machine import Axis
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import misdescribed

CAUGHT_BY = CaughtBy("03_homing.home", "homed")

POSITIVE_LIMIT_SWITCH = 18
"""Homing method (CiA 402-2, table 'Homing methods')."""


@misdescribed("rotate")
def break_controller(axis: Axis) -> Axis:
    return axis.model_copy(update={"homing": axis.homing.model_copy(update={"method": POSITIVE_LIMIT_SWITCH})})
