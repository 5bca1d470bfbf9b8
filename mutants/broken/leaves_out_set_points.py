"""Sends one axis no set-point in every hundredth cycle."""

from __future__ import annotations

from itertools import count

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.single", "setpoints_every_cycle")

calls = count(1)


@instead_of(DriveNode, "send_output")
def break_controller(send: Original, self: DriveNode) -> None:
    if next(calls) % 100:
        send(self)
