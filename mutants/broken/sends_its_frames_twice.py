"""Sends every set-point twice, to be sure."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("09_bus.load", "no_flood")


def break_controller() -> None:
    send = DriveNode.send_output

    def broken(self: DriveNode) -> None:
        send(self)
        send(self)

    replace(DriveNode, "send_output", broken)
