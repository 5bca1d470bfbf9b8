"""Bears twenty cycles without an answer, and takes what comes then for what is so now."""

from __future__ import annotations

from controller import supervision
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("08_faults.frames_late", "outcome")

BORNE = 20


def break_controller() -> None:
    replace(supervision, "MISSED", BORNE)
