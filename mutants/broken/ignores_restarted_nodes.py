"""Looks at EMCY and statusword only, so it does not notice a node that restarts."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.node_resets", "stopped")


def break_controller() -> None:
    beside = (supervision.emergency, supervision.left_operation)
    leave_out(*(check for check in supervision.CHECKS if check not in beside))
