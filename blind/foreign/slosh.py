"""Something loose on the load: a liquid in its vessel, a tool that hangs on it."""

from __future__ import annotations

from math import pi
from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Slosh(Foreign):
    """A mass on a soft spring on the joint's far side: x'' = -a - 2 damping_ratio w x' - w² x, its push inertia (x'' + a)."""

    name: ClassVar[str] = "slosh"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._offset, self._rate = 0.0, 0.0
        self._last_velocity = 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        inertia = 0.7 * scale.torque / scale.acceleration
        return {"inertia": inertia, "frequency": draw.uniform(1.2, 2.5), "damping_ratio": draw.uniform(0.03, 0.08)}

    def act(self, axis: Axis) -> Influence:
        acceleration = (axis.velocity - self._last_velocity) / axis.cycle
        self._last_velocity = axis.velocity
        w = 2.0 * pi * self.values["frequency"]
        restoring = 2.0 * self.values["damping_ratio"] * w * self._rate + w**2 * self._offset
        self._rate -= (acceleration + restoring) * axis.cycle
        self._offset += self._rate * axis.cycle
        return Influence(pull=self.values["inertia"] * restoring)
