"""Reads a torque by SDO between set-points, in every tenth cycle."""

from __future__ import annotations

from drivetwin.controller.cycle import Cycle
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.single", "no_sdo_while_streaming")

UPLOAD_OF_THE_TORQUE = bytes((0x40, 0x77, 0x60, 0, 0, 0, 0, 0))


@instead_of(Cycle, "run")
def break_controller(run: Original, self: Cycle) -> None:
    run(self)
    if self.count % 10 == 0:
        self._link.send(0x601, UPLOAD_OF_THE_TORQUE)
