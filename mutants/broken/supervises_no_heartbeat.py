"""Does not notice that a node's heartbeat is missing."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.heartbeat_lost", "outcome")


def break_controller() -> None:
    leave_out(supervision.heartbeat_lost)
