"""The motion that is repeated: one axis from rest to rest, the others holding."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.controller.feedforward.rest import with_rest
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.motion.jerk_limited import JerkLimited, MotionLimits, jerk_limited


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
