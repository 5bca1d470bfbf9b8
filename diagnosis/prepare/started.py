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
SAMPLES = 500
"""Of a recording, from which its warming is told: it is slow."""
ONE_CLOCK = 1.0
"""By which recordings may begin apart on their own clocks [s]: beyond it these tell when each began."""
WARM = 0.01
"""Of the coldest recording's b, at which a machine counts as warm."""


@dataclass(frozen=True)
class Started:
    """Training and validation recordings, their time counted from when the coldest began, and how that is known."""

    runs: list[Run]
    checks: list[Run]
    notes: tuple[str, ...] = ()


def started(axes: Sequence[str], runs: Sequence[Run], checks: Sequence[Run]) -> Started:
    """Recordings as they are, where any says when it began, where their clocks differ already, or where no axis has a
    temperature in all of them that rises in one and falls in none.

    Else the axis whose temperature rises most tells it.
    """
    every = [*runs, *checks]
    as_they_are = Started(list(runs), list(checks))
    clocks = [float(run.recording.time[0]) for run in every]
    stated = any(run.recording.info.start_time is not None for run in every)
    if len(every) < 2 or stated or max(clocks) - min(clocks) > ONE_CLOCK:
        return as_they_are
    warming = {axis: seen for axis in axes if _rises(seen := [_temperature(run, axis) for run in every])}
    if not warming:
        return as_they_are
    axis = max(warming, key=lambda each: max(map(_rise, warming[each])))
    after = _after_the_coldest(warming[axis])
    if after is None:
        return as_they_are
    later = [run.later(each - clock) for run, each, clock in zip(every, after, clocks, strict=True)]
    words = ", ".join(f"{run.recording.name} {each:.0f} s" for run, each in zip(every, after, strict=True))
    note = f"no recording says when it began; by the temperature of {axis}, after the coldest: {words}."
    return Started(later[: len(runs)], later[len(runs) :], (note,))


Temperature = tuple[Array, Array]
"""Times (n,) since a recording began [s], and the temperature (n,) [degC]."""


def _temperature(run: Run, axis: str) -> Temperature:
    """No more samples than a line needs."""
    values = run.recording.columns[axis].get("temperature", np.empty(0))
    there = np.flatnonzero(np.isfinite(values))
    there = there[:: max(1, len(there) // SAMPLES)]
    return run.recording.time[there] - run.recording.time[0], values[there]


def _rises(seen: Sequence[Temperature]) -> bool:
    if not all(len(time) > 1 for time, _ in seen):
        return False
    rises = [_rise(one) for one in seen]
    return max(rises) >= LEAST_RISE and min(rises) > -LEAST_RISE


def _rise(one: Temperature) -> float:
    """By how much the temperature rises in a recording [K]: its line of least squares, which noise does not raise."""
    time, values = one
    return float(np.polyfit(time, values, 1)[0] * np.ptp(time)) if np.ptp(time) > 0.0 else 0.0


def _after_the_coldest(seen: Sequence[Temperature]) -> list[float] | None:
    """When each recording began after the coldest [s], by least squares; None where none is colder than in the end."""
    longest = max(float(np.ptp(time)) for time, _ in seen)
    found = [_colder(seen, constant) for constant in np.geomspace(FASTEST, max(SPANS * longest, 2.0 * FASTEST), TRIED)]
    _, constant, colder = min(found, key=lambda one: one[0])
    coldest = float(colder.max())
    if coldest <= 0.0:
        return None
    return [float(constant * np.log(coldest / max(each, WARM * coldest))) for each in colder.tolist()]


def _colder(seen: Sequence[Temperature], constant: float) -> tuple[float, float, Array]:
    """Sum of squares that a time constant leaves, the constant, and by how much colder than in the end each began (R,) [K]."""
    target = np.concatenate([values for _, values in seen])
    decays = block_diag(*[np.exp(-time / constant)[:, None] for time, _ in seen])
    columns = np.column_stack([np.ones(len(target)), -decays])
    values = np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sum((target - columns @ values) ** 2)), constant, values[1:]
