"""Starts and ends every move at full speed, without a ramp."""

from __future__ import annotations

from math import ceil

import numpy as np

from drivetwin.controller.motion import positions_now, stream
from drivetwin.controller.session import Session
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("04_moves.single", "limits")


@instead_of(Session, "travel")
def break_controller(_original: Original, self: Session, targets: dict[str, float]) -> None:
    start = positions_now(self.drives)
    end = np.array([targets.get(drive.name, at) for drive, at in zip(self.drives, start.tolist(), strict=True)])
    fastest = np.array([drive.axis.max_speed for drive in self.drives])
    rows = max(1, ceil(np.max(np.abs(end - start) / fastest) / self.cycle.period))
    stream(self.cycle, self.drives, np.linspace(start, end, rows + 1)[1:])
