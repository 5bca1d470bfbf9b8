"""Configures no heartbeat of the drives, and expects none."""

from __future__ import annotations

from drivetwin.controller import error_control, supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out, replace

CAUGHT_BY = CaughtBy("01_boot.configured", "heartbeat")


def break_controller() -> None:
    replace(error_control, "NODE_BEATS_EVERY", 0.0)
    leave_out(supervision.heartbeat_lost)
