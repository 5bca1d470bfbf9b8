"""Sends the target of an axis as one set-point instead of planning the motion."""

from __future__ import annotations

import numpy as np

from drivetwin.controller.motion import positions_now, stream
from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.single", "no_jump")


@instead_of(Session, "travel")
def break_controller(_original: Original, self: Session, targets: dict[str, float]) -> None:
    here = dict(zip(self.machine.axes, positions_now(self.drives).tolist(), strict=True))
    stream(self.cycle, self.drives, np.array([list((here | targets).values())]))
