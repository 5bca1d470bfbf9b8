"""Omits SYNC in every hundredth cycle, so that one SYNC serves two set-points."""

from __future__ import annotations

from drivetwin.controller.cycle import Cycle
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("09_bus.load", "no_flood")


@instead_of(Cycle, "run")
def break_controller(run: Original, self: Cycle) -> None:
    if self.count % 100 == 0:
        for drive in self._drives:
            drive.send_output()
    run(self)
