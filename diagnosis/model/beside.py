"""The unknown of one axis beside noise: taken out of products of columns, and how large the evidence has it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]
Index = NDArray[np.intp]

NEWTON = 8
"""Steps to an amplitude."""
NEXT_TO_NONE = 1e-3
"""Of the usual amplitude, at which a component is as good as not there."""


@dataclass(frozen=True)
class Products:
    """Of one axis: inner products of the columns that act on it and the target, A'A (k, k), with the unknown's, U'A (m, k).

    `index` (k - 1,): which of all columns they are; the target is the last.
    """

    gram: Array
    across: Array
    index: Index


@dataclass(frozen=True)
class Inner:
    """The unknown of one axis beside noise: B = D G D + level² 1, factorised (m, m), D = diag `roots` (m,) its amplitudes."""

    roots: Array
    factor: Array
    level: float

    @classmethod
    def of(cls, gram: Array, roots: Array, level: float) -> Inner:
        """Of the products of its columns (m, m)."""
        whole = gram * np.outer(roots, roots)
        whole[np.diag_indices_from(whole)] += level**2
        return cls(roots, np.asarray(linalg.cholesky(whole, lower=True, check_finite=False)), level)

    def half(self, across: Array) -> Array:
        """What the unknown explains of columns, as a root: its products, of products with the unknown's (m, p)."""
        scaled = (across.T * self.roots).T
        return np.asarray(linalg.solve_triangular(self.factor, scaled, lower=True, check_finite=False))

    def reduced(self, part: Products) -> Array:
        """Products of columns with the unknown taken out."""
        half = self.half(part.across)
        return np.asarray(part.gram - half.T @ half)

    def mean(self, across: Array) -> Array:
        """Of the unknown's coefficients (m,) or (m, k), of products of rows with its columns."""
        half = self.half(across)
        return (linalg.solve_triangular(self.factor, half, lower=True, trans=1, check_finite=False).T * self.roots).T

    @property
    def logarithm(self) -> float:
        """Half the logarithm of |B / level²|: what the evidence pays for it."""
        return float(np.sum(np.log(np.diag(self.factor)))) - len(self.roots) * float(np.log(self.level))

    def tuned(self, component: Index, mean: Array, amplitude: Array, misfit: float) -> Array:
        """Amplitudes (K,) nearer to where the evidence is highest: MacKay 1992, eq. 4.12, with their prior.

        `mean` (m,): of the coefficients, with the present ones. Without any component, as they are.
        """
        if not len(self.roots):
            return amplitude
        inverse = linalg.lapack.dpotri(self.factor, lower=1)[0]
        known = 1.0 - self.level**2 * np.diag(inverse)
        told = np.maximum(np.bincount(component, known, len(amplitude)), 0.0)
        squares = np.bincount(component, mean**2, len(amplitude))
        found = np.minimum(np.sqrt(squares / np.maximum(told, 1e-300)), np.cbrt(squares * misfit))
        for _ in range(NEWTON):  # of told a² + a³ / misfit = squares, which is convex: from above, for neither is more
            slope = 2.0 * told * found + 3.0 * found**2 / misfit + 1e-300
            found = found - (told * found**2 + found**3 / misfit - squares) / slope
        return np.asarray(np.maximum(found, NEXT_TO_NONE * misfit))
