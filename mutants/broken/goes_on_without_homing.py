"""Assumes that a node that has restarted still knows its zero."""

from __future__ import annotations

from drivetwin.controller.recovery import recover
from drivetwin.controller.session import Session
from drivetwin.controller.tasks import base
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("10_recovery.node_resets", "homed")


def break_controller() -> None:
    def broken(session: Session) -> None:
        recover(session)
        for drive in session.drives:
            drive.homed = True

    replace(base, "recover", broken)
