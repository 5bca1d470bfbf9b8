"""A wheel that slips on its shaft: cogging in position whose phase does not stay."""

from __future__ import annotations

from math import pi, sin, sqrt
from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class WanderingCogging(Foreign):
    """torque = amplitude sin(2 pi q / period + phase(t)), the phase on a random walk of a turn in about `time_constant`."""

    name: ClassVar[str] = "wandering_cogging"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._phase = 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        period = scale.room / draw.uniform(8.0, 25.0)
        return {"amplitude": 1.4 * scale.torque, "period": period, "time_constant": draw.uniform(0.7, 2.0)}

    def act(self, axis: Axis) -> Influence:
        self._phase += 2.0 * pi * sqrt(axis.cycle / self.values["time_constant"]) * self.draw.standard_normal()
        return Influence(pull=self.values["amplitude"] * sin(2.0 * pi * axis.position / self.values["period"] + self._phase))
