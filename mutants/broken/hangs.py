"""Waits forever for something that does not come, after it has brought up the drives."""

from __future__ import annotations

from threading import Event

from drivetwin.controller import session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("01_boot.configured", "outcome")


@instead_of(session, "check_motors")
def break_controller(_original: Original, *_arguments: object) -> None:
    Event().wait()
