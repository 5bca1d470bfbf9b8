"""Moves each axis as fast as it can, one beside the other, instead of all in step."""

from __future__ import annotations

from controller.session import Session
from mutants.base import CaughtBy
from mutants.surgery import replace

CAUGHT_BY = CaughtBy("05_paths.square", "synchronised")


def break_controller() -> None:
    replace(Session, "travel", Session.go_to)
