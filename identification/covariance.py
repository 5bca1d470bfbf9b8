"""Covariance of the estimate that remains valid where neighbouring residuals are correlated.

    Cov = A^-1 B A^-1,   A = X' W X,   B = long-run covariance of the scores w x e

(heteroskedasticity- and autocorrelation-consistent, Newey and West 1987) with the quadratic-spectral kernel over all lags,
which makes B positive semidefinite (its spectrum is nowhere negative; cut off at some lag it would be), and the automatic
bandwidth of Andrews 1991. The scores are first summed over the filter's correlation time 1 / cut-off, so that
lags count in units in which the residual can forget. Quantiles are Student's t with the degrees of freedom that the
kernel leaves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, special

from drivetwin.foundation.errors import UserError
from drivetwin.identification.regressors import Design
from drivetwin.recording.recording import Samples


@dataclass(frozen=True)
class Covariance:
    """`matrix` (p, p) of the parameters and the `degrees_of_freedom` of its estimate."""

    matrix: Samples
    degrees_of_freedom: float

    def transformed(self, jacobian: Samples) -> Covariance:
        """Covariance of jacobian (r, p) times the parameters."""
        return Covariance(jacobian @ self.matrix @ jacobian.T, self.degrees_of_freedom)

    def standard_error(self, index: int) -> float:
        """Of parameter `index`. Raises UserError where its variance is not positive: no interval has a width of zero."""
        variance = float(self.matrix[index, index])
        if not variance > 0.0:
            raise UserError(
                f"the fit leaves no scatter to take an interval from (variance {variance:g}): "
                "the recordings are too short or not measured; record a longer motion"
            )
        return float(np.sqrt(variance))

    def quantile(self, confidence: float) -> float:
        """Half width of the two-sided interval in standard errors."""
        return float(special.stdtrit(self.degrees_of_freedom, 0.5 + confidence / 2.0))

    def p_value(self, value: float, index: int) -> float:
        """Of the hypothesis that parameter `index`, estimated as `value`, is zero; two-sided."""
        return float(2.0 * special.stdtr(self.degrees_of_freedom, -abs(value) / self.standard_error(index)))


def hac_covariance(design: Design, jacobian: Samples, residual: Samples) -> Covariance:
    """Covariance of the parameters whose derivatives are the columns of `jacobian` (n, p), at `residual` (n,)."""
    scale = np.linalg.norm(jacobian * np.sqrt(design.weight)[:, None], axis=0)
    scaled = jacobian / scale
    bread = np.linalg.inv(scaled.T @ (scaled * design.weight[:, None]))
    series = _block_sums(design, scaled * (design.weight * residual)[:, None])
    count = sum(len(part) for part in series)
    parameters = jacobian.shape[1]
    bandwidth = _andrews_bandwidth([part @ bread for part in series], count)
    meat = _long_run(series, bandwidth)
    correction = count / max(count - parameters, 1)
    freedom = max(count / bandwidth - parameters, 2.0)
    matrix = correction * bread @ meat @ bread / np.outer(scale, scale)
    return Covariance(matrix, freedom)


def _block_sums(design: Design, scores: Samples) -> list[Samples]:
    """Scores summed over each block in which at least one row counts, one (blocks, p) a recording.

    What follows a pause becomes the neighbour of what precedes it: it can only widen the interval.
    """
    parts = []
    for piece in np.unique(design.piece):
        rows = design.piece == piece
        if not design.weight[rows].any():
            continue
        block = design.block[rows]
        sums = np.column_stack([np.bincount(block, weights=values) for values in scores[rows].T])
        used = np.bincount(block, weights=design.weight[rows]) > 0
        parts.append(np.asarray(sums[used], dtype=np.float64))
    return parts


def _andrews_bandwidth(series: list[Samples], count: int) -> float:
    """1.3221 (alpha n)^(1/5) with alpha of AR(1) fits to the components (Andrews 1991, equations 6.2 and 6.4)."""
    above = below = 0.0
    for index in range(series[0].shape[1]):
        now = np.concatenate([part[1:, index] for part in series])
        before = np.concatenate([part[:-1, index] for part in series])
        power = float(before @ before)
        if power == 0.0:
            continue
        rho = float(np.clip(now @ before / power, -0.97, 0.97))
        variance = float(np.mean((now - rho * before) ** 2))
        # Each component is weighted by 1 / variance^2 so that units do not matter.
        normed = variance / (power / max(len(before), 1))
        above += 4.0 * rho**2 * normed**2 / (1.0 - rho) ** 8
        below += normed**2 / (1.0 - rho) ** 4
    alpha = above / below if below else 0.0
    return float(np.clip(1.3221 * (alpha * count) ** 0.2, 1.0, max(count / 8.0, 1.0)))


def _long_run(series: list[Samples], bandwidth: float) -> Samples:
    """Sum over lags of kernel times autocovariance, lags within a recording only; (p, p), positive semidefinite."""
    width = series[0].shape[1]
    total = np.zeros((width, width))
    for part in series:
        kernel = _quadratic_spectral(np.arange(len(part)) / bandwidth)
        total += part.T @ linalg.matmul_toeplitz(kernel, part)
    return np.asarray((total + total.T) / 2.0, dtype=np.float64)


def _quadratic_spectral(x: Samples) -> Samples:
    """25 / (12 pi^2 x^2) (sin(6 pi x / 5) / (6 pi x / 5) - cos(6 pi x / 5)), 1 at 0; (n,)."""
    angle = 6.0 * np.pi * np.maximum(x, 1e-4) / 5.0
    return np.asarray(3.0 / angle**2 * (np.sin(angle) / angle - np.cos(angle)), dtype=np.float64)
