"""Crashes on an error of its own after it has brought up the drives."""

from __future__ import annotations

from drivetwin.controller import session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("01_boot.configured", "outcome")


@instead_of(session, "check_motors")
def break_controller(_original: Original, drives: list[object], machine: object) -> None:
    raise IndexError(f"no drive {len(drives) + 1} on {machine}")
