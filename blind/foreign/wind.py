"""A force that nobody sees coming: wind on a panel, a person who leans on it."""

from __future__ import annotations

from math import exp, sqrt
from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Wind(Foreign):
    """A Gauss-Markov torque of rms `torque`."""

    name: ClassVar[str] = "wind"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._torque = 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        return {"torque": 1.1 * scale.torque, "time_constant": draw.uniform(0.1, 0.6)}

    def act(self, axis: Axis) -> Influence:
        kept = exp(-axis.cycle / self.values["time_constant"])
        self._torque = kept * self._torque + sqrt(1.0 - kept**2) * self.values["torque"] * self.draw.standard_normal()
        return Influence(pull=self._torque)
