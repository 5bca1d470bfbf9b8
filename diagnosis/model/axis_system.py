"""One axis of the linear model, whitened: what is to be explained there, and the columns of its unknown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.colour import Colour

Array = NDArray[np.float64]
Index = NDArray[np.intp]

Amplitudes = Mapping[str, Array]
"""Of each axis, of each component of its unknown (K,) [N·m or N]."""


@dataclass(frozen=True)
class AxisSystem:
    """One axis, whitened: the unknown's columns (N, m), their products (m, m), the component (m,) of each, and y (N,).

    `misfit`: what amplitudes usually are [N·m or N].
    """

    colour: Colour
    unknown: Array
    gram: Array
    component: Index
    misfit: float
    target: Array
    blocks: Index

    @property
    def usual(self) -> Array:
        """Amplitudes (K,) as they usually are."""
        return np.full(int(self.component.max(initial=-1)) + 1, self.misfit)

    def unlikely(self, amplitude: Array) -> float:
        """How rare amplitudes (K,) are [nats]: exponential."""
        return float(np.sum(amplitude)) / self.misfit


def axis_system(colour: Colour, unknown: Array, component: Index, misfit: float, target: Array, blocks: Index) -> AxisSystem:
    """`unknown` (N, m): its columns as they are felt, for coefficients of rms `misfit` [N·m or N]; the component of each."""
    columns = colour.whiten(unknown)
    return AxisSystem(colour, columns, columns.T @ columns, component, misfit, colour.whiten(target), blocks)
