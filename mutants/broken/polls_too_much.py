"""Asks every drive for three objects by SDO in every cycle of a motion."""

from __future__ import annotations

from drivetwin.controller.cycle import Cycle
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("09_bus.load", "bus_load")

OBJECTS = (0x6077, 0x606C, 0x6041)


@instead_of(Cycle, "run")
def break_controller(run: Original, self: Cycle) -> None:
    run(self)
    for drive in (drive for drive in self._drives if drive.streaming):
        for index in OBJECTS:
            self._link.send(0x600 + drive.node_id, bytes((0x40, index & 0xFF, index >> 8, 0, 0, 0, 0, 0)))
