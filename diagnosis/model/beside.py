"""The unknown of one axis beside noise: taken out of products of columns, and how large the evidence has it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from drivetwin.foundation.compiled import compiled

Array = NDArray[np.float64]
Index = NDArray[np.intp]

NEWTON = 8
"""Steps to an amplitude."""
SLOWEST = 4.0
"""Steps in which a series of amplitudes comes nearer to its end by a factor e, at most."""
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
        """Of the products of its columns (m, m). Raises LinAlgError where these are none; what is not finite stays so."""
        whole = gram * roots * roots[:, None]
        whole.flat[:: len(roots) + 1] += level**2
        if not len(roots):
            return cls(roots, whole, level)
        factor, failed = linalg.lapack.dpotrf(whole.T, lower=1, clean=1, overwrite_a=1)
        if failed:
            raise linalg.LinAlgError("the unknown beside noise has no factor")
        return cls(roots, factor, level)

    def half(self, across: Array) -> Array:
        """What the unknown explains of columns, as a root: its products, of products with the unknown's (m, p)."""
        return self._behind((across.T * self.roots).T, 0)

    def _behind(self, columns: Array, transposed: int) -> Array:
        """Columns (m,) or (m, p) by the inverse of the factor; it has no zero on its diagonal."""
        if not len(self.roots):
            return columns
        return np.asarray(linalg.lapack.dtrtrs(self.factor, columns, lower=1, trans=transposed)[0]).reshape(columns.shape)

    def reduced(self, part: Products) -> Array:
        """Products of columns with the unknown taken out."""
        half = self.half(part.across)
        return np.asarray(part.gram - half.T @ half)

    def mean(self, across: Array) -> Array:
        """Of the unknown's coefficients (m,) or (m, k), of products of rows with its columns."""
        return (self._behind(self.half(across), 1).T * self.roots).T

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
        inverse = linalg.lapack.dtrtri(self.factor, lower=1)[0]
        known = 1.0 - self.level**2 * np.einsum("ij,ij->j", inverse, inverse)
        told = np.maximum(np.bincount(component, known, len(amplitude)), 0.0)
        squares = np.bincount(component, mean**2, len(amplitude))
        return np.asarray(np.maximum(_likeliest(told, squares, misfit), NEXT_TO_NONE * misfit))


def farther(first: Array, second: Array, third: Array, misfit: float) -> Array:
    """Where amplitudes (K,) are bound for that went from the first to the third: each a geometric series of its logarithm.

    Aitken's delta-squared process (Proceedings of the Royal Society of Edinburgh 46, 1926). It is trusted as far as a factor e:
    the first steps are no such series.
    """
    step, last = np.log(second / first), np.log(third / second)
    ratio = np.divide(last, step, out=np.zeros_like(step), where=np.abs(step) > 1e-9)
    ratio = np.clip(ratio, 0.0, 1.0 - 1.0 / SLOWEST)
    ahead = np.clip(last * ratio / (1.0 - ratio), -1.0, 1.0)
    return np.asarray(np.maximum(third * np.exp(ahead), NEXT_TO_NONE * misfit))


@compiled
def _likeliest(told, squares, misfit):  # type: ignore[no-untyped-def]
    """Where told a² + a³ / misfit = squares, (K,): convex, so Newton's steps come from above, for neither is more."""
    found = np.empty_like(told)
    for k in range(told.shape[0]):
        a = min(np.sqrt(squares[k] / max(told[k], 1e-300)), np.cbrt(squares[k] * misfit))
        for _ in range(NEWTON):
            a -= (told[k] * a**2 + a**3 / misfit - squares[k]) / (2.0 * told[k] * a + 3.0 * a**2 / misfit + 1e-300)
        found[k] = a
    return found
