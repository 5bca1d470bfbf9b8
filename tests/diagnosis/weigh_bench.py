"""Rows and systems made by hand, small enough for a dense Gaussian."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.diagnosis.prepare.rows import AxisRows
from drivetwin.diagnosis.report.result import Array

PERIOD = 0.01


def rows_of(stretches: Sequence[int], runs: Sequence[int] | None = None, blocks: int = 1) -> AxisRows:
    """Stretches of contiguous rows; `runs`: the recording of each, all of one without; `blocks` of equal length."""
    lengths = np.array(stretches)
    count = int(lengths.sum())
    run = np.repeat(np.zeros(len(lengths), dtype=np.intp) if runs is None else np.array(runs), lengths)
    start = np.zeros(count, dtype=np.bool_)
    start[np.concatenate(([0], np.cumsum(lengths)[:-1]))] = True
    return AxisRows(run, np.arange(count), start, np.arange(count) * blocks // count, np.ones(count), np.zeros(count))


def autoregressive(rng: np.random.Generator, count: int, coefficients: Sequence[float], deviation: float) -> Array:
    """e[t] = sum of a[j] e[t - j] plus white noise of a standard deviation, (n,), after it has settled."""
    order = len(coefficients)
    out = np.zeros(count + 500)
    noise = deviation * rng.standard_normal(len(out))
    for t in range(order, len(out)):
        out[t] = np.dot(coefficients, out[t - order : t][::-1]) + noise[t]
    return out[500:]
