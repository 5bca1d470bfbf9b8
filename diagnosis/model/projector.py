"""What the columns of a system and the unknown explain, taken off rows: a local search for an effect sees the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.axis_system import Amplitudes, AxisSystem
from drivetwin.diagnosis.model.beside import Inner, Products
from drivetwin.diagnosis.model.solve import inverse_of
from drivetwin.foundation.cached import cached_property

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Projector:
    """Least squares with the columns and the unknown taken out: what a local search for an effect minimises.

    `products` are those of `columns`, by axis: nothing of the size of the rows is computed twice.
    """

    axes: Mapping[str, AxisSystem]
    columns: Mapping[str, Array]
    products: Mapping[str, Products]
    spreads: Array
    level: Mapping[str, float]
    amplitude: Amplitudes

    @cached_property
    def _inverse(self) -> Array:
        information = np.diag(1.0 / self.spreads**2)
        for axis, part in self.products.items():
            information[np.ix_(part.index, part.index)] += self._inner[axis].reduced(part) / self.level[axis] ** 2
        return inverse_of(information)

    @cached_property
    def _inner(self) -> dict[str, Inner]:
        return {
            axis: Inner.of(own.gram, self.amplitude[axis][own.component], self.level[axis]) for axis, own in self.axes.items()
        }

    def left(self, rows: Mapping[str, Array]) -> Array:
        """Whitened rows (N,) or (N, k) of each axis, in units of the noise, less what is explained; axis after axis.

        Behind them what columns and unknown need, in units of their priors: the sum of squares is that of the evidence.
        """
        unknown = {axis: own.unknown.T @ rows[axis] for axis, own in self.axes.items()}
        right = np.zeros((len(self.spreads), *next(iter(rows.values())).shape[1:]))
        for axis, part in self.products.items():
            own_right = self.columns[axis].T @ rows[axis] - part.across.T @ self._inner[axis].mean(unknown[axis])
            right[part.index] += own_right / self.level[axis] ** 2
        b = self._inverse @ right
        parts, needed = [], []
        for axis, own in self.axes.items():
            part, own_b = self.products[axis], b[self.products[axis].index]
            inner = self._inner[axis]
            amount = inner.mean(unknown[axis] - part.across @ own_b)
            parts.append((rows[axis] - self.columns[axis] @ own_b - own.unknown @ amount) / self.level[axis])
            needed.append((amount.T / np.maximum(inner.roots, 1e-300)).T)
        return np.concatenate([*parts, *needed, (b.T / self.spreads).T])
