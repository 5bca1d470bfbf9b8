"""How much of a gap goes with something: least squares on some of the time, judged on the rest; noise explains nothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.report.result import Array

FOLDS = 5
_RIDGE = 1e-9
"""Of the mean square of a column: keeps apart what the data cannot, and no more."""


@dataclass(frozen=True)
class Folds:
    """Which fold each sample (n,) is in: contiguous stretches of time, dealt in turn."""

    of_sample: NDArray[np.intp]

    @cached_property
    def _members(self) -> list[NDArray[np.intp]]:
        return [np.flatnonzero(self.of_sample == fold) for fold in range(FOLDS)]

    def explained(self, regressors: Array, target: Array) -> float:
        """Energy of `target` (n,) that `regressors` (n, p) predict where they were not fitted; negative where they mislead."""
        parts = [(regressors[members], target[members]) for members in self._members]
        grams = np.array([columns.T @ columns for columns, _ in parts])
        loads = np.array([columns.T @ held for columns, held in parts])
        fitted = [solve(grams.sum(axis=0) - gram, loads.sum(axis=0) - load) for gram, load in zip(grams, loads, strict=True)]
        return sum(_energy(*each) for each in zip(fitted, grams, loads, strict=True))

    def explained_in(self, fold: int, regressors: Array, target: Array) -> float:
        """The part of `explained` that lies in one fold, fitted on the others."""
        held = self.of_sample == fold
        columns = regressors[held]
        return _energy(fit(regressors[~held], target[~held]), columns.T @ columns, columns.T @ target[held])


def _energy(coefficients: Array, gram: Array, load: Array) -> float:
    """y'y - (y - X c)'(y - X c) from X'X and X'y."""
    return float(2.0 * coefficients @ load - coefficients @ gram @ coefficients)


def fit(regressors: Array, target: Array) -> Array:
    """Least squares coefficients (p,)."""
    return solve(regressors.T @ regressors, regressors.T @ target)


def solve(gram: Array, load: Array) -> Array:
    """Least squares coefficients (p,) from X'X (p, p) and X'y (p,)."""
    ridge = _RIDGE * np.diag(gram) + np.finfo(np.float64).tiny
    return np.asarray(np.linalg.solve(gram + np.diag(ridge), load))


def hats(values: Array, knots: Array) -> Array:
    """Piecewise linear shape functions (n, k) on rising `knots` (k,), constant beyond the ends; every row adds up to 1."""
    at = np.clip(np.interp(values, knots, np.arange(len(knots), dtype=np.float64)), 0.0, len(knots) - 1.0)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(len(knots)))))
