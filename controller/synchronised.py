"""Several axes from rest to rest together: one jerk-limited phase moves them all along a straight line in joint space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.controller.joint_path import JointPath
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import JerkLimited, MotionLimits, jerk_limited

_STANDS = 1e-12
"""A way [m or rad] that no encoder sees."""


@dataclass(frozen=True)
class Synchronised:
    """Axes that go from `start` to `end` (axes,) in phase: each is start + phase (end - start), the phase from 0 to 1."""

    start: tuple[float, ...]
    end: tuple[float, ...]
    phase: JerkLimited

    @property
    def duration(self) -> float:
        """Seconds from rest to rest, the same for all axes."""
        return self.phase.duration

    def sample(self, period: float) -> JointPath:
        """Rows at period, 2 period, ... (n, axes); the last is the end."""
        phase = self.phase.sample(period)
        start, end = np.array(self.start), np.array(self.end)
        return JointPath(
            period=period,
            position=np.outer(1.0 - phase.position, start) + np.outer(phase.position, end),
            velocity=np.outer(phase.velocity, end - start),
            acceleration=np.outer(phase.acceleration, end - start),
        )

    def scaled_to(self, duration: float) -> Synchronised:
        """The same line in `duration` seconds; raises UserError where that is shorter."""
        return replace(self, phase=self.phase.scaled_to(duration))


def synchronised(start: Sequence[float], end: Sequence[float], limits: Sequence[MotionLimits]) -> Synchronised:
    """The quickest straight line in joint space within the limits of every axis; all axes start and end together.

    An axis's limits over its way are limits of the common phase, and the tightest of each kind counts: the slowest axis rules,
    the others are scaled down to it. Raises UserError where start, end and limits are not of the same axes.
    """
    if not len(start) == len(end) == len(limits):
        raise UserError(
            f"a move needs start, end and limits of the same axes; it got {len(start)}, {len(end)} and {len(limits)} of them"
        )
    ways = [(abs(b - a), limit) for a, b, limit in zip(start, end, limits, strict=True) if abs(b - a) > _STANDS]
    if not ways:
        return Synchronised(tuple(start), tuple(end), JerkLimited(1.0, 1.0, 0.0, 0.0, 0.0))
    tightest = MotionLimits(
        speed=min(limit.speed / way for way, limit in ways),
        acceleration=min(limit.acceleration / way for way, limit in ways),
        jerk=min(limit.jerk / way for way, limit in ways),
    )
    return Synchronised(tuple(start), tuple(end), jerk_limited(0.0, 1.0, tightest))
