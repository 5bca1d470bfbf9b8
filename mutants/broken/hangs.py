"""Waits forever for something that does not come, after it has brought up the drives."""

from __future__ import annotations

from threading import Event

from drivetwin.controller import session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("01_boot.configured", "outcome")


def break_controller() -> None:
    def broken(*_arguments: object) -> None:
        Event().wait()

    replace(session, "check_motors", broken)
