"""When recordings began that do not say it, by how much warmer than the coldest the machine was: their temperature says it.

A machine warms up as T_end - b exp(-t / tau) (first order: Bittencourt, Gunnarsson, J. Dyn. Sys. Meas. Control 134(5), 2012).
A recording that began a time s after the coldest has the same T_end and tau with b exp(-s / tau).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from drivetwin.diagnosis.prepare.run import Run

Array = NDArray[np.float64]

FASTEST = 5.0
"""Time constant of the quickest warming, that of a motor's winding [s]."""
SPANS = 10.0
"""Times the longest recording, that a time constant may be: in a slower warming a temperature is a straight line."""
TRIED = 60
"""Time constants, evenly on a scale of logarithms."""
LEAST_RISE = 1.0
"""By which a temperature has to rise within a recording to tell a time constant [K]: some steps of a usual sensor."""
WARM = 0.01
"""Of the coldest recording's b, at which a machine counts as warm."""


@dataclass(frozen=True)
class Started:
    """Training and validation recordings, their time counted from when the coldest began, and how that is known."""

    runs: list[Run]
    checks: list[Run]
    notes: tuple[str, ...] = ()


def started(axes: Sequence[str], runs: Sequence[Run], checks: Sequence[Run]) -> Started:
    """Recordings as they are, where any says when it began, or no axis has a temperature in all of them that rises.

    Else the axis whose temperature rises most tells it.
    """
    every = [*runs, *checks]
    told = [run for run in every if run.recording.info.start_time is not None]
    warming = {axis: seen for axis in axes if (seen := [_temperature(run, axis) for run in every]) and _rises(seen)}
    if len(every) < 2 or told or not warming:
        return Started(list(runs), list(checks))
    axis = max(warming, key=lambda each: _rise(warming[each]))
    began = _began(warming[axis])
    later = [run.later(each) for run, each in zip(every, began, strict=True)]
    words = ", ".join(f"{run.recording.name} {each:.0f} s" for run, each in zip(every, began, strict=True))
    note = f"no recording says when it began; by the temperature of {axis}, after the coldest: {words}."
    return Started(later[: len(runs)], later[len(runs) :], (note,))


Temperature = tuple[Array, Array]
"""Times (n,) [s], and the temperature (n,) [degC]."""


def _temperature(run: Run, axis: str) -> Temperature:
    values = run.recording.columns[axis].get("temperature", np.empty(0))
    there = np.flatnonzero(np.isfinite(values))
    return run.recording.time[there], values[there]


def _rises(seen: Sequence[Temperature]) -> bool:
    return all(len(time) for time, _ in seen) and _rise(seen) >= LEAST_RISE


def _rise(seen: Sequence[Temperature]) -> float:
    """The most by which the temperature rises in a recording [K]: its line of least squares, which noise does not raise."""
    lines = [np.polyfit(time, values, 1)[0] * np.ptp(time) if np.ptp(time) > 0.0 else 0.0 for time, values in seen]
    return float(max(lines))


def _began(seen: Sequence[Temperature]) -> list[float]:
    """When each recording began after the coldest [s], by least squares."""
    longest = max(float(np.ptp(time)) for time, _ in seen)
    found = [_colder(seen, constant) for constant in np.geomspace(FASTEST, max(SPANS * longest, 2.0 * FASTEST), TRIED)]
    _, constant, colder = min(found, key=lambda one: one[0])
    coldest = float(colder.max())
    return [float(constant * np.log(coldest / max(each, WARM * coldest))) for each in colder.tolist()]


def _colder(seen: Sequence[Temperature], constant: float) -> tuple[float, float, Array]:
    """Sum of squares that a time constant leaves, the constant, and by how much colder than in the end each began (R,) [K]."""
    target = np.concatenate([values for _, values in seen])
    decays = block_diag(*[np.exp(-time / constant)[:, None] for time, _ in seen])
    columns = np.column_stack([np.ones(len(target)), -decays])
    values = np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sum((target - columns @ values) ** 2)), constant, values[1:]
