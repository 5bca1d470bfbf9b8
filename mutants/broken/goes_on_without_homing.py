"""Assumes that a node that has restarted still knows its zero."""

from __future__ import annotations

from drivetwin.controller.recovery import recover
from drivetwin.controller.session import Session
from drivetwin.controller.tasks import base
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("10_recovery.node_resets", "homed")


@instead_of(base, "recover")
def break_controller(_original: Original, session: Session) -> None:
    recover(session)
    for drive in session.drives:
        drive.homed = True
