"""Runs with a cycle of 4 ms, whatever the task says."""

from __future__ import annotations

from drivetwin.controller import perform
from drivetwin.controller.session import Streaming
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("09_bus.load", "sync_period")


@instead_of(perform, "_streaming")
def break_controller(_original: Original, _order: object) -> tuple[Streaming, str]:
    return Streaming(0.004), ""
