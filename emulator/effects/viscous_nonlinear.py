"""Viscous friction that is not proportional to the speed: a churned lubricant, a grease that shears thin."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from emulator.dynamics import FrictionLaw
from emulator.effects.base import CUBIC, QUADRATIC, FrictionEffect, Parameter


@dataclass(frozen=True)
class ViscousNonlinear(FrictionEffect):
    """torque = -(quadratic |v| + cubic v²) v, beside the law's `viscous`; negative is less than proportional.

    The odd polynomial of MuJoCo's joint damping (MuJoCo manual, Polynomial forces).
    """

    name: ClassVar[str] = "viscous_nonlinear"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("quadratic", QUADRATIC),
        Parameter("cubic", CUBIC),
    )

    quadratic: float
    cubic: float = 0.0

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, quadratic=self.quadratic, cubic=self.cubic)
