"""The colour of the noise: an autoregression of what is left, by which rows become independent of each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.rows import AxisRows, Index
from drivetwin.foundation.compiled import compiled

Array = NDArray[np.float64]

SHRUNK = 1e-4
"""Share of white noise that is taken to be in any residual: keeps the recursion well conditioned."""


@dataclass(frozen=True)
class Colour:
    """Prediction errors of rows (N,) that stand at equal intervals but for gaps.

    `predictors[j]` (j,): coefficients of the j rows before, newest first; `deviation[j]`: of the error then, in that of the
    longest. Levinson's recursion: Percival and Walden, Spectral Analysis for Physical Applications, 1993, sec. 9.4.
    """

    groups: tuple[Index, ...]
    """Rows that share an interval of time, recording by recording."""
    predictors: tuple[tuple[Array, ...], ...]
    deviation: tuple[Array, ...]
    scale: tuple[float, ...]
    """Of the innovations of each group [N·m or N]."""
    age: Index
    """Rows directly before each, at most the order."""

    @property
    def logarithm(self) -> float:
        """Sum over rows of the logarithm of what each is divided by: the density of rows that are not white needs it."""
        total = 0.0
        for rows, deviation, scale in zip(self.groups, self.deviation, self.scale, strict=True):
            total += float(np.sum(np.log(deviation[self.age[rows]] * scale)))
        return total

    @property
    def level(self) -> float:
        """Of the innovations of the first group [N·m or N]: of all, where the noise is white. 0 without any row."""
        return self.scale[0] if self.scale else 0.0

    @property
    def independent(self) -> float:
        """As many rows as would tell a mean as well if they were independent: Bartlett's, by the density at zero frequency."""
        count = 0.0
        for rows, predictors, deviation in zip(self.groups, self.predictors, self.deviation, strict=True):
            slow = 1.0 / max(1.0 - float(predictors[-1].sum()), 1e-3) ** 2
            count += len(rows) * min(1.0, float(deviation[0]) ** 2 / slow)
        return max(count, 2.0)

    def whiten(self, columns: Array) -> Array:
        """Columns (N, p) or (N,) as uncorrelated rows of equal variance."""
        flat = columns.reshape(len(columns), -1)
        out = np.empty_like(flat)
        for rows, predictors, deviation, scale in zip(self.groups, self.predictors, self.deviation, self.scale, strict=True):
            _whiten(flat, rows, self.age, _table(predictors), deviation * scale, out)
        return out.reshape(columns.shape)


def white(rows: AxisRows, intervals: Array, level: float, order: int) -> Colour:
    """No colour: what a search begins with, at a level [N·m or N]. `intervals` [s] between rows, of each recording."""
    groups = _groups(rows, intervals)
    return Colour(
        groups,
        tuple(tuple(np.zeros(j) for j in range(order + 1)) for _ in groups),
        tuple(np.ones(order + 1) for _ in groups),
        tuple(level for _ in groups),
        _age(rows, order),
    )


def colour_of(rows: AxisRows, intervals: Array, residual: Array, order: int, floor: float) -> Colour:
    """The colour of a residual (N,) [N·m or N], Yule-Walker, for each interval of time between rows on its own.

    `floor`: rms of white noise that is in any comparison.
    """
    age, groups = _age(rows, order), _groups(rows, intervals)
    predictors, deviations, levels = [], [], []
    for group in groups:
        own, known = residual[group], age[group]
        power = float(np.mean(own**2)) if len(own) else 0.0
        correlation = np.zeros(order + 1)
        correlation[0] = (1.0 + SHRUNK) * power + floor**2
        for lag in range(1, order + 1):
            pairs = np.flatnonzero(known >= lag)
            if len(pairs) > 4 * order:
                correlation[lag] = float(own[pairs] @ own[pairs - lag]) / len(own)  # over all rows: never indefinite
        table, variance = _levinson(correlation)
        predictors.append(table)
        deviations.append(np.sqrt(variance / variance[-1]))
        levels.append(max(float(np.sqrt(variance[-1])), 1e-300))
    return Colour(groups, tuple(predictors), tuple(deviations), tuple(levels), age)


def _groups(rows: AxisRows, intervals: Array) -> tuple[Index, ...]:
    rounded = np.round(np.log(intervals) * 20.0).astype(int)
    return tuple(
        np.flatnonzero(np.isin(rows.run, np.flatnonzero(rounded == one)))
        for one in np.unique(rounded)
        if np.isin(rows.run, np.flatnonzero(rounded == one)).any()
    )


def _age(rows: AxisRows, order: int) -> Index:
    count = np.arange(len(rows))
    first = np.maximum.accumulate(np.where(rows.start, count, 0))
    return np.minimum(count - first, order)


def _levinson(correlation: Array) -> tuple[tuple[Array, ...], Array]:
    order = len(correlation) - 1
    table: list[Array] = [np.zeros(0)]
    variance = [float(correlation[0])]
    for j in range(1, order + 1):
        before = table[-1]
        reflection = (correlation[j] - before @ correlation[1:j][::-1]) / variance[-1]
        reflection = float(np.clip(reflection, -0.9999, 0.9999))
        table.append(np.concatenate([before - reflection * before[::-1], [reflection]]))
        variance.append(variance[-1] * (1.0 - reflection**2))
    return tuple(table), np.array(variance)


def _table(predictors: tuple[Array, ...]) -> Array:
    """(order + 1, order): a predictor for each age; without columns where none predicts anything."""
    order = len(predictors) - 1
    if not predictors[order].any():
        return np.zeros((order + 1, 0))
    table = np.zeros((order + 1, order))
    for j, own in enumerate(predictors):
        table[j, :j] = own
    return table


@compiled
def _whiten(columns, rows, age, table, deviation, out) -> None:  # type: ignore[no-untyped-def]
    """Some rows of columns (N, p) less what the rows before them predict, over their deviations, into the same of `out`."""
    width, order = columns.shape[1], table.shape[1]
    for row in rows:
        old = min(age[row], order)
        for k in range(width):
            error = columns[row, k]
            for lag in range(old):
                error -= table[old, lag] * columns[row - 1 - lag, k]
            out[row, k] = error / deviation[age[row]]
