"""Viscous friction: a torque proportional to the speed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.effects.base import DAMPING, Effect, FrictionLaw, Parameter


@dataclass(frozen=True)
class Viscous(Effect):
    """torque = -viscous v: MuJoCo's joint `damping`."""

    name: ClassVar[str] = "viscous"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("viscous", DAMPING, low=0.0),)

    viscous: float

    def add_to(self, joint: mujoco.MjsJoint, law: FrictionLaw) -> FrictionLaw:
        return replace(law, viscous=self.viscous)

    def predict(self, velocity: NDArray[np.float64], acceleration: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.viscous * velocity
