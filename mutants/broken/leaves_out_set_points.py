"""Sends one axis no set-point in every hundredth cycle."""

from __future__ import annotations

from itertools import count

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("04_moves.single", "setpoints_every_cycle")


def break_controller() -> None:
    send, calls = DriveNode.send_output, count(1)

    def broken(self: DriveNode) -> None:
        if next(calls) % 100:
            send(self)

    replace(DriveNode, "send_output", broken)
