"""Moves each axis as fast as it can, independently, instead of all in step."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("05_paths.square", "synchronised")


def break_controller() -> None:
    replace(Session, "travel", Session.go_to)
