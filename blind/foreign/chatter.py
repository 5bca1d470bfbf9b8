"""Friction that is never the same: dirt in a guide, a seal that grips and lets go."""

from __future__ import annotations

from math import exp, sqrt
from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Chatter(Foreign):
    """Friction times 1 + size x(t), x a Gauss-Markov process of unit variance, not below a tenth."""

    name: ClassVar[str] = "chatter"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._noise = 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        return {"size": min(scale.torque / scale.friction, 0.8), "time_constant": draw.uniform(0.05, 0.3)}

    def act(self, axis: Axis) -> Influence:
        kept = exp(-axis.cycle / self.values["time_constant"])
        self._noise = kept * self._noise + sqrt(1.0 - kept**2) * self.draw.standard_normal()
        return Influence(friction=max(0.1, 1.0 + self.values["size"] * self._noise))
