"""A bearing with a broken cage: its friction is now as it should be, now more, for seconds at a time."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Jamming(Foreign):
    """Friction times `factor` in spells that come and go at random."""

    name: ClassVar[str] = "jamming"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._jams, self._until = False, 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        return {"factor": min(1.0 + 1.5 * scale.torque / scale.friction, 3.0), "spell": draw.uniform(0.8, 2.0)}

    def act(self, axis: Axis) -> Influence:
        if axis.time >= self._until:
            self._jams = not self._jams
            self._until = axis.time + self.values["spell"] * self.draw.uniform(0.4, 1.6)
        return Influence(friction=self.values["factor"] if self._jams else 1.0)
