"""Sends every set-point twice, to be sure."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("09_bus.load", "no_flood")


@instead_of(DriveNode, "send_output")
def break_controller(send: Original, self: DriveNode) -> None:
    send(self)
    send(self)
