"""The colour of the noise: an autoregression of what is left, by which rows become independent of each other.

Noise is not equally loud everywhere: what no model has shows where friction turns round, and hardly where an axis glides. So
each row has a weight, that of a t distribution of its prediction error (Lange, Little, Taylor, Journal of the American
Statistical Association 84(408), 1989), found by turns with the autoregression. How long the tails are is fitted; noise that is
normal has none, and all weights are 1.

A torque that is recorded in coarse steps errs alike as long as it stays on one: the samples of a plateau tell as much as one of
them. A row of a plateau of k rows counts as 1 / (1 + (k - 1) rho), Kish's design effect of a cluster (Survey Sampling, 1965,
sec. 5.4); rho is the share of what is left that the steps make.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from drivetwin.diagnosis.prepare.rows import AxisRows, Index
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.compiled import compiled

Array = NDArray[np.float64]

FREEDOMS = (2.0, 3.0, 4.0, 6.0, 10.0, 20.0)
"""Degrees of freedom of the t distribution, of which the likeliest is taken, or none: the normal one."""
TURNS = 4
"""Times that autoregression and weights are found in turn."""
STEPS, CONVERGED = 20, 1e-6
"""Of expectation and maximisation, for the scale, at most; relative change of its square, below which they end."""
SHRUNK = 1e-4
"""Share of white noise that is taken to be in any residual: keeps the recursion well conditioned."""


@dataclass(frozen=True)
class Colour:
    """Prediction errors of rows (N,) that stand at equal intervals but for gaps.

    `predictors[j]` (j,): coefficients of the j rows before, newest first; `deviation[j]`: of the error then, in that of the
    longest. Levinson's recursion: Percival and Walden, Spectral Analysis for Physical Applications, 1993, sec. 9.4.
    """

    groups: tuple[Index, ...]
    """Rows of recordings of the same sample rate, at equal intervals: a faster one has less of a sensor's noise in the band."""
    predictors: tuple[tuple[Array, ...], ...]
    deviation: tuple[Array, ...]
    scale: tuple[float, ...]
    """Of the innovations of each group [N·m or N]."""
    age: Index
    """Rows directly before each, at most the order."""
    weight: Array
    """Of each row (N,), the root: what its error is multiplied by."""
    excess: Array
    """Log density of each row (N,) under its t distribution less that under its weighted normal one, of what the weights were
    found from [nats]."""
    counts: Array
    """As how many each row (N,) counts, at most 1."""

    @cached_property
    def logarithm(self) -> float:
        """Sum over rows of the logarithm of what each is divided by, less the excess: the density of rows that are not white
        needs it.

        With the excess the weighted normal density is the lower bound of the t density that touches it where the weights were
        found (Hunter and Lange, The American Statistician 58(1), 2004): so sets in noise of different tails compare.
        """
        total = 0.0
        for rows, deviation, scale in zip(self.groups, self.deviation, self.scale, strict=True):
            divided = np.log(deviation[self.age[rows]] * scale / self.weight[rows])
            total += float(self.counts[rows] @ (divided - self.excess[rows]))
        return total

    @property
    def level(self) -> float:
        """Of the innovations of the first group [N·m or N]: of all, where the noise is white. 0 without any row."""
        return self.scale[0] if self.scale else 0.0

    @property
    def normal(self) -> Colour:
        """The same without weights."""
        return replace(self, weight=np.ones(len(self.weight)), excess=np.zeros(len(self.weight)))

    @cached_property
    def independent(self) -> float:
        """As many rows as would tell a mean as well if they were independent: Bartlett's, by the density at zero frequency."""
        count = 0.0
        for rows, predictors, deviation in zip(self.groups, self.predictors, self.deviation, strict=True):
            slow = 1.0 / max(1.0 - float(predictors[-1].sum()), 1e-3) ** 2
            count += float(self.counts[rows].sum()) * min(1.0, float(deviation[0]) ** 2 / slow)
        return max(count, 2.0)

    def whiten(self, columns: Array) -> Array:
        """Columns (N, p) or (N,) as uncorrelated rows of equal variance."""
        flat = columns[:, None] if columns.ndim == 1 else columns
        out = np.empty_like(flat)
        for rows, predictors, deviation, scale in zip(self.groups, self.predictors, self.deviation, self.scale, strict=True):
            _whiten(flat, rows, self.age, _table(predictors), deviation * scale, out)
        return np.asarray((out.T * (self.weight * np.sqrt(self.counts))).T).reshape(columns.shape)


def white(rows: AxisRows, clocks: Array, level: float, order: int) -> Colour:
    """No colour: what a search begins with, at a level [N·m or N]. `clocks`: see `colour_of`."""
    groups = _groups(rows, clocks)
    return Colour(
        groups,
        tuple(tuple(np.zeros(j) for j in range(order + 1)) for _ in groups),
        tuple(np.ones(order + 1) for _ in groups),
        tuple(level for _ in groups),
        _age(rows, order),
        np.ones(len(rows)),
        np.zeros(len(rows)),
        _counts(rows, np.full(len(rows), level**2)),
    )


def colour_of(rows: AxisRows, clocks: Array, residual: Array, order: int, floor: float) -> Colour:
    """The colour of a residual (N,) [N·m or N], Yule-Walker, for each sample rate on its own.

    `clocks` (R, 2) [s]: of each recording, between samples as they were recorded and between rows.

    `floor`: rms of white noise that is in any comparison.
    """
    age, groups = _age(rows, order), _groups(rows, clocks)
    weight, excess, errors = np.ones(len(rows)), np.zeros(len(rows)), np.zeros((len(rows), 1))
    counts = _counts(rows, np.full(len(rows), np.mean(residual**2) if len(residual) else 0.0))
    predictors, deviations, levels = [], [], []
    for group in groups:
        own, known, roots, told = residual[group], age[group], weight[group], counts[group]
        for _ in range(TURNS):
            table, variance = _levinson(_correlation(own * roots, told, known, order, floor))
            deviation, level = np.sqrt(variance / variance[-1]), max(float(np.sqrt(variance[-1])), 1e-300)
            _whiten(residual[:, None], group, age, _table(table), deviation, errors)
            roots, above, level = _tails(errors[group, 0], told, level, floor)
        weight[group], excess[group] = roots, above
        predictors.append(table)
        deviations.append(deviation)
        levels.append(level)
    return Colour(groups, tuple(predictors), tuple(deviations), tuple(levels), age, weight, excess, counts)


def _counts(rows: AxisRows, left: Array) -> Array:
    """As how many each row counts (N,), where so much is `left` (N,), a variance."""
    share = np.minimum(rows.coarse / np.maximum(left, 1e-300), 1.0)
    return np.asarray(1.0 / (1.0 + (rows.repeats - 1.0) * share))


def _tails(errors: Array, counts: Array, level: float, floor: float) -> tuple[Array, Array, float]:
    """Of errors (n,), the t distribution that fits them best: the root of each one's weight, how much denser that is than the
    weighted normal one [nats], and its scale, no less than the floor; 1, 0 and their `level` under the normal one.
    """
    total, roots, excess = float(counts.sum()), np.ones_like(errors), np.zeros_like(errors)
    normal = float(np.sqrt(np.average(errors**2, weights=counts))) if errors.any() else 0.0
    if not normal > 0.0:
        return roots, excess, level
    best, likeliest = -total * (np.log(normal * np.sqrt(2.0 * np.pi)) + 0.5), None
    begin = float(np.median(errors**2)) or normal**2
    for freedom in FREEDOMS:
        square, logarithms = _of_t(errors, counts, freedom, begin)
        if square == 0.0:
            continue
        likelihood = total * (_peak(freedom) - 0.5 * np.log(square)) - 0.5 * (freedom + 1.0) * logarithms
        if likelihood > best:
            best, likeliest, level = likelihood, freedom, max(float(np.sqrt(square)), floor)
    if likeliest is not None:
        roots = np.sqrt((likeliest + 1.0) / (likeliest + (errors / level) ** 2))
        excess = stats.t.logpdf(errors, likeliest, 0.0, level) - stats.norm.logpdf(errors * roots, 0.0, level) - np.log(roots)
    return roots, excess, level


@cache
def _peak(freedom: float) -> float:
    """Log density of a t distribution of scale 1 at 0."""
    return float(stats.t.logpdf(0.0, freedom))


@compiled
def _of_t(errors, counts, freedom, square):  # type: ignore[no-untyped-def]
    """The square of the likeliest scale of a t distribution of errors (n,), by expectation and maximisation from a first one,
    and the sum over them of log(1 + error² / (freedom scale²)), each as often as it counts; 0 and infinity without a scale.
    """
    total = counts.sum()
    for _ in range(STEPS):
        moment = 0.0
        for k in range(errors.shape[0]):
            own = errors[k] ** 2
            moment += counts[k] * own / (freedom + own / square)
        last, square = square, (freedom + 1.0) * moment / total
        if not square > 0.0:
            return 0.0, np.inf
        if abs(square - last) < CONVERGED * square:
            break
    logarithms = 0.0
    for k in range(errors.shape[0]):
        logarithms += counts[k] * np.log1p(errors[k] ** 2 / (freedom * square))
    return square, logarithms


def _correlation(own: Array, counts: Array, known: Index, order: int, floor: float) -> Array:
    """Of rows (N,) by lag, (order + 1,), with the white noise that is in any."""
    total, own = float(counts.sum()), own * np.sqrt(counts)
    power = float(own @ own) / total if len(own) else 0.0
    correlation = np.zeros(order + 1)
    correlation[0] = (1.0 + SHRUNK) * power + floor**2
    for lag in range(1, order + 1):
        pairs = np.flatnonzero(known >= lag)
        if len(pairs) > 4 * order:
            correlation[lag] = float(own[pairs] @ own[pairs - lag]) / total  # over all rows: never indefinite
    return correlation


def _groups(rows: AxisRows, clocks: Array) -> tuple[Index, ...]:
    rounded = np.round(np.log(clocks) * 20.0).astype(int)
    alike = [np.flatnonzero((rounded == one).all(axis=1)) for one in np.unique(rounded, axis=0)]
    return tuple(np.flatnonzero(own) for runs in alike if (own := np.isin(rows.run, runs)).any())


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
