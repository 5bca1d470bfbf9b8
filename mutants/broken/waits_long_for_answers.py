"""Tolerates twenty cycles without an answer, and treats the next answer as current."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.frames_late", "outcome")

BORNE = 20


def break_controller() -> None:
    replace(supervision, "MISSED", BORNE)
