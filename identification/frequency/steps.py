"""The step response of the position loop, from steps up and down on a way at constant speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.recording.recording import Recording, Samples

BAND = 0.02
"""About the new position, as a share of the step: an axis that stays in it has settled."""


@dataclass(frozen=True)
class Stepped:
    """A recording in which the position of `axis` was stepped by `height` [rad or m] at the samples `up` and back at `down`, as
    often in each direction of the way; each step lasts `length` samples."""

    recording: Recording
    axis: str
    height: float
    up: Sequence[int]
    down: Sequence[int]
    length: int


@dataclass(frozen=True)
class StepResponse:
    """`position` (n,) as a share of the step over `time` (n,) [s] since the set-point took effect.

    `rise` [s] from 10 to 90 %, `overshoot` [1] of the step, `settling` [s] until it stays within `BAND`; None where it does not
    get there while a step lasts.
    """

    time: Samples
    position: Samples
    rise: float | None
    overshoot: float
    settling: float | None


def step_response(stepped: Stepped) -> StepResponse:
    """Half the difference of the means of steps up and down: what the way and its friction do is in both."""
    columns = stepped.recording.columns[stepped.axis]
    up, down = (_mean(columns["position"], columns["position_demand"], at, stepped.length) for at in (stepped.up, stepped.down))
    position = np.asarray(1.0 + (up - down) / (2.0 * stepped.height))
    time = np.asarray(np.arange(stepped.length) * stepped.recording.info.sample_period, dtype=np.float64)
    first, last = (_reaches(time, position, level) for level in (0.1, 0.9))
    outside = np.flatnonzero(np.abs(position - 1.0) > BAND)
    settled = outside.size == 0 or outside[-1] + 1 < len(time)
    return StepResponse(
        time,
        position,
        last - first if first is not None and last is not None else None,
        max(0.0, float(position.max()) - 1.0),
        float(time[outside[-1] + 1]) if outside.size and settled else (0.0 if settled else None),
    )


def _mean(position: Samples, demand: Samples, starts: Sequence[int], length: int) -> Samples:
    """Position less the demand's straight line as it ends (length,), mean of all windows."""
    windows = []
    for start in starts:
        asked = demand[start : start + length]
        slope = (asked[-1] - asked[length // 2]) / (length - 1 - length // 2)
        windows.append(position[start : start + length] - asked[-1] - slope * (np.arange(length) - (length - 1)))
    return np.asarray(np.mean(windows, axis=0))


def _reaches(time: Samples, position: Samples, level: float) -> float | None:
    """When it first reaches a level [s], by a straight line between two samples."""
    above = np.flatnonzero(position >= level)
    if not above.size:
        return None
    at = max(int(above[0]), 1)
    share = (level - position[at - 1]) / (position[at] - position[at - 1])
    return float(time[at - 1] + share * (time[at] - time[at - 1]))
