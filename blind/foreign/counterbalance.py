"""A pneumatic counterbalance: its gas yields through a throttle, so its force fades with time."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Counterbalance(Foreign):
    """A spring behind a throttle (a Maxwell element): force' = stiffness v - force / time_constant."""

    name: ClassVar[str] = "counterbalance"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._force = 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        return {"stiffness": 8.0 * scale.torque / scale.room, "time_constant": draw.uniform(0.6, 1.5)}

    def act(self, axis: Axis) -> Influence:
        rate = self.values["stiffness"] * axis.velocity - self._force / self.values["time_constant"]
        self._force += rate * axis.cycle
        return Influence(pull=-self._force)
