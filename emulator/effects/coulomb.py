"""Coulomb friction: a constant torque against the motion, and as much stiction at rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.effects.base import TORQUE, Effect, FrictionLaw, Parameter


@dataclass(frozen=True)
class Coulomb(Effect):
    """torque = -coulomb sgn(v): MuJoCo's `frictionloss`, a constraint that holds at rest (MuJoCo manual, Computation)."""

    name: ClassVar[str] = "coulomb"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("coulomb", TORQUE, low=0.0),)

    coulomb: float

    def add_to(self, joint: mujoco.MjsJoint, law: FrictionLaw) -> FrictionLaw:
        return replace(law, coulomb=self.coulomb)

    def predict(self, velocity: NDArray[np.float64], acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.coulomb * np.sign(velocity)
