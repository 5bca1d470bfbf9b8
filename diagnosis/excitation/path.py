"""Pieces of a motion, each from rest to rest: moves, strokes back and forth, standstills, small waves about a place."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

Path = NDArray[np.float64]
"""Positions (n,), one a cycle [m or rad]."""

PAUSE = 0.25
"""Standstill between two pieces [s]."""
_LEFT = 0.95
"""Of the limits, for waves: their peaks are found on samples."""


def stand(position: float, seconds: float, period: float) -> Path:
    """Rest for a while."""
    return np.full(max(1, round(seconds / period)), position)


def move(start: float, end: float, most: MotionLimits, period: float) -> Path:
    """The quickest jerk-limited move; its start is left out."""
    return jerk_limited(start, end, most).sample(period).position


def back_and_forth(start: float, end: float, most: MotionLimits, period: float) -> Path:
    """A stroke and back, with a rest after each; constant speed between the ramps where the way is long enough."""
    there, back = move(start, end, most, period), move(end, start, most, period)
    return np.concatenate([stand(start, PAUSE, period), there, stand(end, PAUSE, period), back])


def wave(place: float, shape: Path, amplitude: float, most: MotionLimits, period: float) -> Path:
    """`amplitude` times a wave `shape` (n,) about a place, smaller where it would break a limit.

    The wave begins and ends at rest: its `shape` has to, up to the second derivative.
    """
    slopes = [np.diff(shape, order) / period**order for order in (1, 2, 3)]
    bounds = (most.speed, most.acceleration, most.jerk)
    allowed = [bound / max(float(np.abs(slope).max()), 1e-300) for slope, bound in zip(slopes, bounds, strict=True)]
    return np.asarray(place + min(amplitude, *(_LEFT * each for each in allowed)) * shape)


def window(count: int) -> Path:
    """sin^4 over a piece (count,): 0 at both ends with three derivatives."""
    return np.asarray(np.sin(np.pi * np.arange(1, count + 1) / count) ** 4)


def joined(parts: Iterable[Path], limits: AxisLimits, period: float) -> Path:
    """One after the other with rests, and moves at half of full speed where one does not begin at the end of the last."""
    whole: list[Path] = []
    for part in parts:
        if whole:
            at = float(whole[-1][-1])
            whole += [stand(at, PAUSE, period), move(at, float(part[0]), limits.slower(0.5), period)]
        whole.append(part)
    return np.concatenate([*whole, stand(float(whole[-1][-1]), PAUSE, period)])
