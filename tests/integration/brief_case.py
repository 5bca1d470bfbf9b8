"""A case of the blind test with some 20 s of motion instead of 100: its workers import this as they import the recorder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from drivetwin.blind import record
from drivetwin.blind.case import Case
from drivetwin.blind.machines import DrawnAxis, DrawnMachine
from drivetwin.blind.motions import PERIOD, Plan, Plans
from drivetwin.controller.trajectory import Positions, stroke


def record_briefly(case: Case, folder: Path) -> None:
    """`record_case`, the same but for its motion: strokes both ways."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(record, "draw_plans", _plans)
        record.record_case(case, folder)


def _plans(machine: DrawnMachine, _seed: int) -> Plans:
    def plan(name: str, shares: Sequence[float]) -> tuple[Plan, ...]:
        return (Plan(name, {axis: _strokes(drawn, shares) for axis, drawn in machine.axes.items()}),)

    fitted = plan("fitted", (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0))
    return Plans(fitted, plan("held", (0.15, 0.4, 0.9)), plan("fresh", (0.25, 0.7)))


def _strokes(axis: DrawnAxis, shares: Sequence[float]) -> Positions:
    """There and back at each share of full speed, the slower ones shorter."""
    parts = []
    for share in shares:
        low, high = (axis.middle + side * 0.4 * axis.room * max(share, 0.1) for side in (-1.0, 1.0))
        ways = ((axis.middle, low), (low, high), (high, axis.middle))
        parts += [stroke(start, end, share * axis.max_speed, 0.7 * axis.max_acceleration, PERIOD) for start, end in ways]
    return np.concatenate(parts)
