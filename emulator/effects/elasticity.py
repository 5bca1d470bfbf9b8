"""An elastic transmission: the motor, with its encoder, moves by itself on a spring and a damper."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import DAMPING, STIFFNESS, Effect, Parameter


@dataclass(frozen=True)
class Elasticity(Effect):
    """Torque = stiffness (m - q) + damping (m' - q'), m the motor's angle by the gear ratio, q the joint's.

    The joint's armature is the motor's side of the spring, its friction stays on the joint's. Spong, ASME J. Dyn. Sys. Meas.
    Control 109(4), 1987.
    """

    name: ClassVar[str] = "elasticity"
    family: ClassVar[str] = "transmission"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
    )

    stiffness: float
    damping: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, transmission=axis.transmission.in_series(self.stiffness, self.damping))
