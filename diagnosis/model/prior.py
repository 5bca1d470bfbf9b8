"""The prior of coefficients: most nominal parameters are off by little, some by much; a tangent holds near its point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Prior:
    """Of coefficients about 0: inverse squares of their scales (q,), 0 for a free one, and degrees of freedom.

    `near` (q,): inverse squares of the steps over which a free one, a tangent, stands for its parameter. It says where the
    straight line holds and not what is likely: a parameter that has settled is at 0.
    """

    base: Array
    freedom: float
    near: Array

    def only(self, free: Index) -> Prior:
        """Of some of them."""
        return Prior(self.base[free], self.freedom, self.near[free])

    def precision(self, values: Array) -> Array:
        """That of the normal distribution which is as steep where they are (q,)."""
        if np.isinf(self.freedom):
            return self.base + self.near
        return np.asarray(self.base * (self.freedom + 1.0) / (self.freedom + values**2 * self.base) + self.near)

    def scales(self, values: Array) -> Array:
        """The standard deviations of that, infinite for a free one."""
        told = self.precision(values)
        return np.asarray(np.where(told > 0.0, 1.0 / np.sqrt(np.maximum(told, 1e-300)), np.inf))

    def cost(self, values: Array) -> float:
        """What it costs that they are off [nats]."""
        squares, far = values**2 * self.base, 0.5 * float(np.sum(values**2 * self.near))
        if np.isinf(self.freedom):
            return 0.5 * float(np.sum(squares)) + far
        return 0.5 * (self.freedom + 1.0) * float(np.sum(np.log1p(squares / self.freedom))) + far
