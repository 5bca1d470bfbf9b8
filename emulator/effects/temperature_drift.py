"""Friction of a machine that is cold at first and warms up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import NUMBER, TIME, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground

_CONSTANTS = (5.0, 2000.0)
"""From a motor's winding to a gear's housing [s]; of a longer one a recording shows a straight line."""
_SPANS = 10.0
"""Times as long as the recordings, with the time between them, that a time constant may be."""
_TRIED = 10


@dataclass(frozen=True)
class TemperatureDrift(FrictionEffect):
    """All friction times 1 + cold exp(-t / time_constant), t since the plant was switched on: warm it is what the others say.

    First-order warming; that friction follows the lubricant's temperature: Bittencourt and Gunnarsson, ASME J. Dyn. Sys. Meas.
    Control 134(5), 2012.
    """

    name: ClassVar[str] = "temperature_drift"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.TIME})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WARM_UP})
    by_motion: ClassVar[str] = "the same strokes from cold until warm"
    by_sensor: ClassVar[str] = "a temperature sensor on the motor or the gear"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LEVEL})
    on_friction: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("cold", NUMBER, low=-0.9),
        Parameter("time_constant", TIME, low=1e-3),
    )

    cold: float
    time_constant: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, cold=self.cold, warming_time=self.time_constant)

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """Cold friction is up to four times the warm one, never less: the lubricant thins (Bittencourt, Gunnarsson 2012).

        A gear warms in minutes to hours (the same).
        What changes by less than a tenth of itself while it is recorded is another level, and no drift.
        """
        longest = float(np.clip(_SPANS * np.ptp(motion.time), 10.0, 2e4))
        return {"cold": (0.0, 3.0), "time_constant": (5.0, longest)}

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """What changes little while it is recorded is likelier another level, which has a name of its own."""
        spans = self.time_constant / max(float(np.ptp(motion.time)), 1e-9)
        return 0.5 * (max(0.0, log(spans)) / log(2.0)) ** 2

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [cls._start(float(constant)) for constant in np.geomspace(*_CONSTANTS, _TRIED)]

    @classmethod
    def drawn(cls, ground: Ground) -> TemperatureDrift:
        return cls(ground.draw.uniform(0.5, 1.0), ground.draw.uniform(20.0, 50.0))

    @classmethod
    def _start(cls, time_constant: float) -> Start:
        return Start((cls(0.1, time_constant),), lambda found: cls(max(0.1 * found[0], 0.0), time_constant))
