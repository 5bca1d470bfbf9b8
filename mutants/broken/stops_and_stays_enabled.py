"""Stops every axis when something is wrong, but keeps the voltage on."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller import stop
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("08_faults.drive_fault", "stays_disabled")

HELD = 2.0
"""For how long [s], until somebody comes."""


@instead_of(stop, "stop")
def break_controller(_original: Original, cycle: Cycle, drives: Sequence[DriveNode]) -> str:
    for drive in drives:
        drive.operating = drive.streaming = False
    for _ in range(round(HELD / cycle.period)):
        stop._run(cycle)
    return "every axis is held"
