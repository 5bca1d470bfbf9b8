"""Viscous friction that differs with the direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.effects.base import DAMPING, Effect, FrictionLaw, Parameter


@dataclass(frozen=True)
class ViscousAsymmetry(Effect):
    """torque = -(viscous + asymmetry) v for v > 0, -(viscous - asymmetry) v for v < 0 (Janot, Gautier, Brunot 2019, sec. 4)."""

    name: ClassVar[str] = "viscous_asymmetry"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("asymmetry", DAMPING),)

    asymmetry: float

    def add_to(self, joint: mujoco.MjsJoint, law: FrictionLaw) -> FrictionLaw:
        return replace(law, viscous_asymmetry=self.asymmetry)

    def predict(self, velocity: NDArray[np.float64], acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.asymmetry * np.abs(velocity)
