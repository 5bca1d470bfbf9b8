"""A fan or a pump on the load: a force that swings in time, wherever the axis is."""

from __future__ import annotations

from math import pi, sin
from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Fan(Foreign):
    """torque = amplitude sin(2 pi frequency t + phase)."""

    name: ClassVar[str] = "fan"

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        return {"amplitude": 1.2 * scale.torque, "frequency": draw.uniform(2.0, 9.0), "phase": draw.uniform(-pi, pi)}

    def act(self, axis: Axis) -> Influence:
        angle = 2.0 * pi * self.values["frequency"] * axis.time + self.values["phase"]
        return Influence(pull=self.values["amplitude"] * sin(angle))
