"""Knocks from outside, at any time: a neighbour that starts, parts that fall on the table."""

from __future__ import annotations

from math import pi, sin
from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Pulses(Foreign):
    """Half sines of either sign, one after a random time after the other."""

    name: ClassVar[str] = "pulses"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._start, self._length, self._height = 0.0, 0.0, 0.0
        self._next(0.0)

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        return {"height": 4.0 * scale.torque, "pause": draw.uniform(0.5, 1.0), "length": draw.uniform(0.06, 0.12)}

    def act(self, axis: Axis) -> Influence:
        if axis.time > self._start + self._length:
            self._next(axis.time)
        since = axis.time - self._start
        return Influence(pull=self._height * sin(pi * since / self._length) if since > 0.0 else 0.0)

    def _next(self, time: float) -> None:
        self._start = time + self.draw.exponential(self.values["pause"])
        self._length = self.values["length"] * self.draw.uniform(0.7, 1.4)
        self._height = self.values["height"] * self.draw.choice((-1.0, 1.0)) * self.draw.uniform(0.6, 1.2)
