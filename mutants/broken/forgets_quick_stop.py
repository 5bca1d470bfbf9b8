"""Exits at once when something is wrong, without stopping the drives."""

from __future__ import annotations

from drivetwin.controller import stop
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.safe_torque_off", "disabled_at_end")


@instead_of(stop, "stop")
def break_controller(_original: Original, *_arguments: object) -> str:
    return "the drives are left as they are"
