"""Counts its cycles as if each took twice as long."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("02_enable.enable", "holds")


@instead_of(Session, "wait")
def break_controller(wait: Original, self: Session, seconds: float) -> None:
    wait(self, 0.5 * seconds)
