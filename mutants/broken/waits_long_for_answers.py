"""Bears twenty cycles without an answer, and takes what comes then for what is so now."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.frames_late", "outcome")

BORNE = 20


def break_controller() -> None:
    replace(supervision, "MISSED", BORNE)
