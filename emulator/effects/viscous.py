"""Viscous friction: a torque proportional to the speed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from emulator.dynamics import FrictionLaw
from emulator.effects.base import DAMPING, FrictionEffect, Parameter


@dataclass(frozen=True)
class Viscous(FrictionEffect):
    """torque = -viscous v: MuJoCo's joint `damping`."""

    name: ClassVar[str] = "viscous"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("viscous", DAMPING, low=0.0),)

    viscous: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, viscous=self.viscous)
