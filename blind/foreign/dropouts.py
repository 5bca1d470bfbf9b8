"""A loose contact in the motor cable: for moments the shaft gives less than the current says."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Dropouts(Foreign):
    """Motor torque times `gain` for `length` seconds, after pauses of random length."""

    name: ClassVar[str] = "dropouts"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._start, self._end = 0.0, 0.0

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        share = scale.torque / scale.axis_torque
        return {"gain": 1.0 - min(2.0 * share, 0.6), "pause": draw.uniform(0.25, 0.5), "length": draw.uniform(0.04, 0.08)}

    def act(self, axis: Axis) -> Influence:
        if axis.time >= self._end:
            self._start = axis.time + self.draw.exponential(self.values["pause"])
            self._end = self._start + self.values["length"] * self.draw.uniform(0.6, 1.4)
        return Influence(gain=self.values["gain"] if axis.time >= self._start else 1.0)
