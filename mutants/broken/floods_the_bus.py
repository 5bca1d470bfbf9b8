"""Sends unrequested frames, as fast as it can."""

from __future__ import annotations

from drivetwin.controller.cycle import Cycle
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("09_bus.load", "outcome")


@instead_of(Cycle, "run")
def break_controller(run: Original, self: Cycle) -> None:
    run(self)
    for _ in range(200):
        self._link.send(0x7F0, bytes(8))
