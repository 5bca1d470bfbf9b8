"""Enables drives again with the set-points that they had before the fault."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.controller import session
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.motion import enable_streaming, follow
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("10_recovery.fault_reset", "no_jump")


@instead_of(session, "enable_streaming")
def break_controller(_original: Original, cycle: Cycle, drives: Sequence[DriveNode]) -> None:
    former = [drive.setpoint for drive in drives]
    enable_streaming(cycle, drives)
    if all(drive.allowed is not None for drive in drives):  # they have streamed before
        for drive, setpoint in zip(drives, former, strict=True):
            drive.setpoint = setpoint
        follow(cycle, drives)
