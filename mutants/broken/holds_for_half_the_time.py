"""Counts its cycles as if each took twice as long."""

from __future__ import annotations

from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("02_enable.enable", "holds")


def break_controller() -> None:
    wait = Session.wait

    def broken(self: Session, seconds: float) -> None:
        wait(self, 0.5 * seconds)

    replace(Session, "wait", broken)
