"""The value of a term on data it was not fitted on: energy of 0.5 s means, 5 folds of alternating blocks.

A friction law is about the mean torque at a speed, not about ripple; hence the means.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drivetwin.identification.regressors import Design, Label
from drivetwin.recording.recording import Samples

_BLOCK = 0.5
_FOLDS = 5

Predict = Callable[[Samples, Samples, Samples], Samples]
"""(regressors (b, p) and target (b,) to fit, regressors (h, p) held out) -> prediction (h,)."""


class Blocks:
    """The 0.5 s blocks of a regression in which at least one row counts."""

    def __init__(self, design: Design) -> None:
        seconds = np.floor(design.seconds / _BLOCK).astype(np.int64)
        _, block = np.unique(np.column_stack([design.piece, seconds]), axis=0, return_inverse=True)
        self._block = block.ravel()
        self._weight = design.weight
        total = np.bincount(self._block, weights=design.weight)
        self._used = total > 0
        self._root = np.sqrt(total[self._used])

    def means(self, values: Samples) -> Samples:
        """Weighted mean of `values` (n,) in each block, times the root of the block's weight, (blocks,)."""
        sums = np.bincount(self._block, weights=values * self._weight)[self._used]
        return np.asarray(sums / self._root, dtype=np.float64)

    def matrix(self, columns: Samples) -> Samples:
        """`means` of each column of (n, p), (blocks, p)."""
        return np.column_stack([self.means(values) for values in columns.T])


def cross_validated_gain(design: Design, fewer: Sequence[Label]) -> float:
    """Share of the cross-validated residual energy that `design` takes away beside its terms `fewer`."""
    blocks = Blocks(design)
    matrix, target = blocks.matrix(design.matrix), blocks.means(design.target)
    few = [design.terms.index(term) for term in fewer]
    return _gain(_held_energy(matrix[:, few], target, least_squares), _held_energy(matrix, target, least_squares))


def searched_gain(matrix: Samples, trials: Samples, target: Samples) -> float:
    """The same for one more column beside `matrix` (b, p), chosen among `trials` (b, k) anew without each fold.

    What the search finds by chance in the other folds has to hold in the one held out.
    """
    width = matrix.shape[1]

    def predict(fitted: Samples, torque: Samples, held: Samples) -> Samples:
        chosen = _best(fitted[:, :width], fitted[:, width:], torque)
        columns = [*range(width)] if chosen is None else [*range(width), width + chosen]
        return least_squares(fitted[:, columns], torque, held[:, columns])

    before = _held_energy(matrix, target, least_squares)
    return _gain(before, _held_energy(np.column_stack([matrix, trials]), target, predict))


def least_squares(fitted: Samples, torque: Samples, held: Samples) -> Samples:
    """Prediction of the rows `held` (h, p) by the fit of `torque` (b,) to `fitted` (b, p)."""
    values, *_ = np.linalg.lstsq(fitted, torque, rcond=None)
    return np.asarray(held @ values, dtype=np.float64)


def _gain(before: float, after: float) -> float:
    return 1.0 - after / before if before > 0 else 0.0


def _held_energy(matrix: Samples, target: Samples, predict: Predict) -> float:
    """Residual energy of each fold under the fit to the others."""
    fold = np.arange(len(target)) % _FOLDS
    energy = 0.0
    for held in range(_FOLDS):
        out = fold == held
        rest = target[out] - predict(matrix[~out], target[~out], matrix[out])
        energy += float(rest @ rest)
    return energy


def _best(matrix: Samples, trials: Samples, target: Samples) -> int | None:
    """The trial that takes away most of the residual energy with a positive coefficient; None where none has one."""
    basis, _ = np.linalg.qr(matrix)
    rest = target - basis @ (basis.T @ target)
    beside = trials - basis @ (basis.T @ trials)
    product, norm = rest @ beside, np.sum(beside**2, axis=0)
    gain = np.where((product > 0) & (norm > 0), product**2 / np.maximum(norm, np.finfo(float).tiny), 0.0)
    return int(np.argmax(gain)) if gain.max() > 0 else None
