"""Reads the drives' torques 5 % too high."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("06_identification.friction", "identification")


def break_controller() -> None:
    take = DriveNode._take_input

    def broken(self: DriveNode, data: bytes) -> None:
        before = self.received
        take(self, data)
        if self.received > before:
            self.torque *= 1.05

    replace(DriveNode, "_take_input", broken)
