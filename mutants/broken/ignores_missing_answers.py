"""Reuses the last answer of a drive if none comes, and does not supervise heartbeats."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out

CAUGHT_BY = CaughtBy("08_faults.frames_lost", "stopped")


def break_controller() -> None:
    leave_out(supervision.silent, supervision.heartbeat_lost, supervision.following_error, supervision.jump)
