"""Exits with status 0, whatever has happened."""

from __future__ import annotations

from drivetwin.controller.outcome import Ending
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.node_dies", "outcome")


def break_controller() -> None:
    replace(Ending, "exit_status", property(lambda _ending: 0))
