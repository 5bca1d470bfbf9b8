"""Standstill before and after a path: what is fed forward may act early, and the axis settles."""

from __future__ import annotations

from math import ceil

import numpy as np

from drivetwin.controller.joint_path import JointPath, Rows

LEAD_IN = 0.03
"""Standstill before the start [s], in which a learned torque may already act."""

DWELL = 0.40
"""Standstill after the end [s], in which the axis settles."""


def with_rest(start: Rows, path: JointPath) -> JointPath:
    """`path` with the lead-in at `start` (axes,) before it and the dwell at its end after it."""
    before, after = rows_of(LEAD_IN, path.period), rows_of(DWELL, path.period)
    around = ((before, after), (0, 0))
    position = np.vstack([np.repeat(start[None, :], before, axis=0), path.position])
    return JointPath(
        period=path.period,
        position=np.pad(position, ((0, after), (0, 0)), mode="edge"),
        velocity=np.pad(path.velocity, around),
        acceleration=np.pad(path.acceleration, around),
    )


def rows_of(seconds: float, period: float) -> int:
    """Rows that last at least `seconds`."""
    return ceil(seconds / period - 1e-9)
