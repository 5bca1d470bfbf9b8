"""Coulomb friction that differs with the direction: a worn screw, a tilted seal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from emulator.dynamics import FrictionLaw
from emulator.effects.base import TORQUE, FrictionEffect, Parameter


@dataclass(frozen=True)
class CoulombAsymmetry(FrictionEffect):
    """torque = -(coulomb + asymmetry) for v > 0, +(coulomb - asymmetry) for v < 0 (Janot, Gautier, Brunot 2019, sec. 4)."""

    name: ClassVar[str] = "coulomb_asymmetry"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("asymmetry", TORQUE),)

    asymmetry: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, coulomb_asymmetry=self.asymmetry)
