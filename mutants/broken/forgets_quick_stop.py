"""Exits at once when something is wrong, without stopping the drives."""

from __future__ import annotations

from drivetwin.controller import stop
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.safe_torque_off", "disabled_at_end")


def break_controller() -> None:
    def broken(*_arguments: object) -> str:
        return "the drives are left as they are"

    replace(stop, "stop", broken)
