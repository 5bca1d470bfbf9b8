"""When most of the gap remains with the selected effects: the intervals in which it is largest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drivetwin.diagnosis.report.result import Array, Diagnosis, Mask, Prediction

_CELL = 0.1
"""Time [s] that is looked at as one."""
_LOUD = 1.5
"""Times the rms of all that remains, from which a cell is part of an interval."""


@dataclass(frozen=True)
class TimeInterval:
    """A stretch of a recording's own time [s] in which more than usual remains: rms [N·m or N], share of all of its energy."""

    recording: str
    begin: float
    end: float
    rms: float
    share: float


def intervals_after(diagnosis: Diagnosis, axis: str) -> tuple[TimeInterval, ...]:
    """Every interval in which more than 1.5 times the rms remains, largest energy first; none where it is spread evenly."""
    whole = sum(prediction.period * _square(prediction, axis).sum() for prediction in diagnosis.predictions)
    loud = _LOUD * diagnosis.after_rms[axis]
    found = [interval for prediction in diagnosis.predictions for interval in _intervals(prediction, axis, loud, whole)]
    return tuple(sorted(found, key=lambda interval: -interval.share))


def _intervals(prediction: Prediction, axis: str, loud: float, whole: float) -> Iterator[TimeInterval]:
    square, used = _square(prediction, axis), prediction.axes[axis].used
    width = max(1, round(_CELL / prediction.period))
    starts = np.arange(0, len(square), width)
    energy, count = np.add.reduceat(square, starts), np.add.reduceat(used.astype(np.float64), starts)
    for first, last in _runs(energy > loud**2 * np.maximum(count, 1.0)):
        end = min(int(starts[last]) + width, len(square)) - 1
        total = float(energy[first : last + 1].sum())
        rms = float(np.sqrt(total / count[first : last + 1].sum()))
        begin = float(prediction.time[starts[first]])
        yield TimeInterval(prediction.recording, begin, float(prediction.time[end]), rms, prediction.period * total / whole)


def _runs(mask: Mask) -> Iterator[tuple[int, int]]:
    """First and last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        yield int(start), int(end) - 1


def _square(prediction: Prediction, axis: str) -> Array:
    found = prediction.axes[axis]
    return np.where(found.used, (found.measured - found.after) ** 2, 0.0)
