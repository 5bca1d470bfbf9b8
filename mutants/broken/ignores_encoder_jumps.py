"""Accepts any position that a drive reports."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.encoder_glitch", "outcome")


def break_controller() -> None:
    leave_out(supervision.jump)
