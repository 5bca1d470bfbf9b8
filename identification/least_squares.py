"""Weighted linear least squares, and which parameters the data can determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.identification.regressors import Design, Label
from drivetwin.recording.recording import Samples

_COLLINEAR = 0.02
_WEIGHT_RATIO = 10.0
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Solution:
    """Least-squares estimate: `values` (p,) of `terms`, `residual` (n,) of all rows."""

    terms: tuple[Label, ...]
    values: Samples
    residual: Samples

    def value(self, term: Label) -> float:
        """The estimate of `term`, 0 where it is not part of the regression."""
        return float(self.values[self.terms.index(term)]) if term in self.terms else 0.0


def solve(design: Design) -> Solution:
    """argmin sum weight (target - matrix values)^2, columns scaled to equal norm before the QR."""
    rows = design.weight > 0
    root = np.sqrt(design.weight[rows])
    matrix = design.matrix[rows] * root[:, None]
    scale = np.linalg.norm(matrix, axis=0)
    scaled, *_ = np.linalg.lstsq(matrix / scale, design.target[rows] * root, rcond=None)
    values = scaled / scale
    return Solution(design.terms, values, design.target - design.matrix @ values)


def identifiable(design: Design) -> tuple[Label, ...]:
    """The terms, first come first served, whose column keeps 2 % of its norm beside those before it."""
    root = np.sqrt(design.weight)
    kept: list[int] = []
    for index in range(len(design.terms)):
        values = design.matrix[:, index] * root
        if share_beside(design.matrix[:, kept] * root[:, None], values) > _COLLINEAR:
            kept.append(index)
    return tuple(design.terms[index] for index in kept)


def told(design: Design) -> tuple[Label, ...]:
    """The terms whose column keeps 2 % of its norm beside all others, whatever their order: of a pair that is alike, neither.

    The share is 1 / sqrt of the variance inflation, here by singular values (Belsley, Kuh, Welsch, Regression Diagnostics,
    1980, 3.2), so that columns which are alike, or zero, do not touch what is said of the others.
    """
    matrix = design.matrix * np.sqrt(design.weight)[:, None]
    norm = np.linalg.norm(matrix, axis=0)
    triangle = np.linalg.qr(matrix / np.where(norm > 0.0, norm, 1.0), mode="r")
    _, singular, directions = np.linalg.svd(triangle)
    inflation = np.sum((directions / np.maximum(singular, _ROUNDING)[:, None]) ** 2, axis=0)
    return tuple(term for term, factor in zip(design.terms, inflation, strict=True) if factor < _COLLINEAR**-2)


def share_beside(matrix: Samples, values: Samples) -> float:
    """Share of its norm that a column `values` (n,) keeps beside those of `matrix` (n, p), all weighted; 0 for zeros."""
    norm = float(np.linalg.norm(values))
    if norm == 0.0:
        return 0.0
    basis, _ = np.linalg.qr(matrix)
    return float(np.linalg.norm(values - basis @ (basis.T @ values))) / norm


def reweighted(design: Design, residual: Samples) -> Design:
    """Feasible generalised least squares: each recording weighted by 1 / (noise variance of its residual).

    The variance is half the mean square of the residual's change over two correlation times of the filter, which sees
    noise but not a slow model error; the ratio of weights is held within 10 of their median. One recording keeps its
    weights.
    """
    pieces = [int(piece) for piece in np.unique(design.piece[design.weight > 0])]
    if len(pieces) < 2:
        return design
    variance = np.array([_noise_variance(design, residual, piece) for piece in pieces])
    middle = float(np.median(variance[variance > 0])) if (variance > 0).any() else 1.0
    factor = np.clip(middle / np.maximum(variance, 1e-12 * middle), 1.0 / _WEIGHT_RATIO, _WEIGHT_RATIO)
    by_piece = np.zeros(int(design.piece.max()) + 1)
    by_piece[pieces] = factor
    return replace(design, weight=design.weight * by_piece[design.piece])


def _noise_variance(design: Design, residual: Samples, piece: int) -> float:
    """Variance of the residual's fast part in one recording."""
    rows = np.flatnonzero(design.piece == piece)
    lag = 2 * int(np.bincount(design.block[rows]).max())
    earlier, later = rows[:-lag], rows[lag:]
    both = (design.weight[earlier] > 0) & (design.weight[later] > 0)
    if both.sum() < 2:
        return 0.0
    return float(np.mean((residual[later][both] - residual[earlier][both]) ** 2) / 2.0)


def relative_error(measured: Sequence[Samples], residual: Sequence[Samples], periods: Sequence[float]) -> float:
    """|measured - model| / |measured|, 2-norms over time; one (n,) a recording. UserError where all torque is zero."""
    above = sum(period * float(part @ part) for part, period in zip(residual, periods, strict=True))
    below = sum(period * float(part @ part) for part, period in zip(measured, periods, strict=True))
    if not below > 0.0:
        raise UserError("the torque is zero in every sample in motion: check that the recording holds the measured torque")
    return float(np.sqrt(above / below))
