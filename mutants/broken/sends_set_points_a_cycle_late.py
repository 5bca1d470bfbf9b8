"""Sends the set-points of one axis a cycle after those of the others."""

from __future__ import annotations

from drivetwin.controller.drive_node import DriveNode
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("05_paths.square", "synchronised")


def break_controller() -> None:
    send = DriveNode.send_output
    last = {"rotate": 0}

    def broken(self: DriveNode) -> None:
        wanted = self.setpoint
        if self.streaming and self.name in last:
            self.setpoint = last[self.name]
        send(self)
        self.setpoint = wanted
        if self.name in last:
            last[self.name] = wanted

    replace(DriveNode, "send_output", broken)
