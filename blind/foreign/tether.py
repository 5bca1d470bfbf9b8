"""A cable that is dragged along: it stretches, then slips in its guides, over a good part of the travel."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from drivetwin.blind.foreign.base import Axis, Draw, Foreign, Influence, Scale, Values


class Tether(Foreign):
    """Two springs that slip at a tenth and at a third of the travel: hysteresis that friction at a joint does not have."""

    name: ClassVar[str] = "tether"

    def __init__(self, values: Values, draw: Draw) -> None:
        super().__init__(values, draw)
        self._slips_at = np.array([values["short"], values["long"]])
        self._force = np.zeros(2)

    @staticmethod
    def drawn(draw: Draw, scale: Scale) -> Values:
        short, long = draw.uniform(0.07, 0.12) * scale.room, draw.uniform(0.25, 0.4) * scale.room
        return {"short": short, "long": long, "torque": 0.8 * scale.torque}

    def act(self, axis: Axis) -> Influence:
        most = self.values["torque"]
        stretched = self._force + most / self._slips_at * axis.velocity * axis.cycle
        self._force = np.clip(stretched, -most, most)
        return Influence(pull=-float(self._force.sum()))
