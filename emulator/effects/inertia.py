"""Inertia of an axis that differs from the model's: a heavier coupling, a motor of another series."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.effects.base import FrictionLaw, Parameter, StaticEffect, Unit


@dataclass(frozen=True)
class Inertia(StaticEffect):
    """torque = difference * acceleration: added to the joint's `armature`, on the joint side."""

    name: ClassVar[str] = "inertia"
    family: ClassVar[str] = "rigid body"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("difference", Unit("kg·m²", "kg")),)

    difference: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, law: FrictionLaw) -> FrictionLaw:
        joint.armature += self.difference
        return law

    def predict(
        self, velocity: NDArray[np.float64], acceleration: NDArray[np.float64], law: FrictionLaw
    ) -> NDArray[np.float64]:
        return self.difference * acceleration
