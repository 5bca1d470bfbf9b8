"""The motion that is repeated: one axis from rest to rest, the others holding."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.motion.jerk_limited import JerkLimited, MotionLimits, jerk_limited

LEAD_IN = 0.03
"""Standstill before the start [s], in which a learned torque may already act."""

DWELL = 0.40
"""Standstill after the end [s], in which the axis settles."""


@dataclass(frozen=True)
class Leg:
    """Axis number `axis` of a machine at `rest` (axes,) [m or rad] goes by `profile`."""

    axis: int
    rest: Rows
    profile: JerkLimited

    def sample(self, period: float) -> JointPath:
        """Lead-in, move, dwell (n, axes); the first row stands, and the last where the move ends."""
        moving = self.profile.sample(period)
        position = np.repeat(self.rest[None, :], len(moving.position), axis=0)
        velocity, acceleration = np.zeros_like(position), np.zeros_like(position)
        position[:, self.axis] = moving.position
        velocity[:, self.axis], acceleration[:, self.axis] = moving.velocity, moving.acceleration
        start = self.rest.copy()
        start[self.axis] = self.profile.start
        return with_rest(start, JointPath(period, position, velocity, acceleration))

    def back(self) -> Leg:
        """The same way back."""
        profile = self.profile
        return replace(self, profile=replace(profile, start=profile.end, end=profile.start))


def leg(rest: Rows, axis: int, end: float, limits: MotionLimits) -> Leg:
    """From `rest` (axes,) [m or rad] to where the axis is at `end`, as quick as `limits` allow."""
    return Leg(axis, rest, jerk_limited(float(rest[axis]), end, limits))


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
