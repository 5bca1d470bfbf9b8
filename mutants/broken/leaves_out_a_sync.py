"""Omits SYNC in every hundredth cycle, so that one SYNC serves two set-points."""

from __future__ import annotations

from drivetwin.controller.cycle import Cycle
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("09_bus.load", "no_flood")


def break_controller() -> None:
    run = Cycle.run

    def broken(self: Cycle) -> None:
        if self.count % 100 == 0:
            for drive in self._drives:
                drive.send_output()
        run(self)

    replace(Cycle, "run", broken)
