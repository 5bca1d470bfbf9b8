"""What is streamed to the drives: joint positions and, for feed-forward, their derivatives, one row per cycle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.controller.machine import Axis
from drivetwin.motion.jerk_limited import MotionLimits

Rows = NDArray[np.float64]

JERK_TIME = 0.05
"""Seconds in which an axis comes from rest to its full acceleration, where nobody says otherwise; axes.yaml gives no jerk."""

_PAST_ROUNDING = 1.0 + 1e-9


@dataclass(frozen=True)
class JointPath:
    """Rows at period, 2 period, ... after the start, (n, axes): position [m or rad], velocity and acceleration [per s, s²]."""

    period: float
    position: Rows
    velocity: Rows
    acceleration: Rows


def joined(paths: Sequence[JointPath]) -> JointPath:
    """Paths of one period, one after the other; each has to start where the last one ends."""
    return JointPath(
        period=paths[0].period,
        position=np.vstack([path.position for path in paths]),
        velocity=np.vstack([path.velocity for path in paths]),
        acceleration=np.vstack([path.acceleration for path in paths]),
    )


class Move(Protocol):
    """A planned move from rest to rest whose shape can be run through more slowly."""

    @property
    def duration(self) -> float:
        """Seconds from rest to rest."""
        ...

    def sample(self, period: float) -> JointPath:
        """Rows at period, 2 period, ...; the last is the end."""
        ...

    def scaled_to(self, duration: float) -> Self:
        """The same move in `duration` seconds; raises UserError where that is shorter."""
        ...


AnyMove = TypeVar("AnyMove", bound=Move)


def limits_of(axis: Axis, jerk_time: float = JERK_TIME) -> MotionLimits:
    """Limits of an axis (axes.yaml); its jerk is such that full acceleration takes `jerk_time` seconds."""
    return MotionLimits(axis.max_speed, axis.max_acceleration, axis.max_acceleration / jerk_time)


def slowed(move: AnyMove, period: float, stretch: Callable[[JointPath], float]) -> AnyMove:
    """`move`, run through so slowly that its samples keep a limit.

    `stretch` says by which factor the time of a path has to grow; up to 1 it keeps the limit. A longer time gives other samples
    of the same curve, so it is asked again.
    """
    while (factor := stretch(move.sample(period))) > 1.0:
        move = move.scaled_to(move.duration * factor * _PAST_ROUNDING)
    return move


def axis_stretch(path: JointPath, limits: Sequence[MotionLimits]) -> float:
    """The factor by which the time of `path` has to grow until every axis keeps its speed and acceleration.

    k times the time divides speeds by k and accelerations by k².
    """
    speed = np.abs(path.velocity) / [limit.speed for limit in limits]
    acceleration = np.abs(path.acceleration) / [limit.acceleration for limit in limits]
    return max(float(speed.max(initial=0.0)), sqrt(float(acceleration.max(initial=0.0))))
