"""A power stage that gives less current than the drive believes: its loops go on asking for more."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import TORQUE, Effect, Parameter


@dataclass(frozen=True)
class TorqueSaturation(Effect):
    """|motor torque| <= limit, on the joint side, in what the motor gives and in what the drive measures: ideal clipping.

    The drive's own limits, at which its integrators stop, are 6072h, 60E0h and 60E1h (CiA 402-2); this is not one of them.
    """

    name: ClassVar[str] = "torque_saturation"
    family: ClassVar[str] = "motor and drive"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("limit", TORQUE, low=1e-6),)

    limit: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, current_limit=self.limit))
