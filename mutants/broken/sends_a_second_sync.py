"""Sends SYNC a second time in every hundredth cycle."""

from __future__ import annotations

from drivetwin.controller import supervision
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.link import SYNC_COB_ID
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import leave_out, replace

CAUGHT_BY = CaughtBy("09_bus.load", "setpoints_every_cycle")


def break_controller() -> None:
    leave_out(supervision.one_too_many)
    run = Cycle.run

    def broken(self: Cycle) -> None:
        run(self)
        if self.count % 100 == 0:
            self._link.send(SYNC_COB_ID, b"")

    replace(Cycle, "run", broken)
