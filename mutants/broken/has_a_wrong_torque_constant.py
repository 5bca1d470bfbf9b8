"""Reads the drives' torques 5 % too high."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("06_identification.friction", "identification")


@instead_of(DriveNode, "_take_input")
def break_controller(take: Original, self: DriveNode, data: bytes) -> None:
    before = self.received
    take(self, data)
    if self.received > before:
        self.torque *= 1.05
