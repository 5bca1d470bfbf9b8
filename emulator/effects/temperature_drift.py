"""Friction of a machine that is cold at first and warms up."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from emulator.dynamics import FrictionLaw
from emulator.effects.base import NUMBER, TIME, FrictionEffect, Parameter


@dataclass(frozen=True)
class TemperatureDrift(FrictionEffect):
    """All friction times 1 + cold exp(-t / time_constant), t since the plant was switched on: warm it is what the others say.

    First-order warming; that friction follows the lubricant's temperature: Bittencourt and Gunnarsson, ASME J. Dyn. Sys. Meas.
    Control 134(5), 2012.
    """

    name: ClassVar[str] = "temperature_drift"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("cold", NUMBER, low=-0.9),
        Parameter("time_constant", TIME, low=1e-3),
    )

    cold: float
    time_constant: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, cold=self.cold, warming_time=self.time_constant)
