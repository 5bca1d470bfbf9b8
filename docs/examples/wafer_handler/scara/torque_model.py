"""The torque that a motion of the arm needs, from what was identified: what is fed forward."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.controller.machine import POSITION_UNIT
from drivetwin.identification.friction_law import FrictionLaw
from wafer_handler.scara.dynamics import BaseParameters, friction, torque


@dataclass(frozen=True)
class ArmTorque:
    """Rigid arm and friction of lift, rotate, stretch; call it with a path (n, 3) for its torque (n, 3) [N, N·m, N·m]."""

    base: BaseParameters
    laws: Mapping[str, FrictionLaw]

    def __call__(self, path: JointPath) -> Rows:
        laws = (self.laws["lift"], self.laws["rotate"], self.laws["stretch"])
        return torque(self.base, path.position, path.velocity, path.acceleration) + friction(laws, _speeds(path))


def _speeds(path: JointPath) -> Rows:
    """Velocities (n, 3) of the path; 0 where no set-point moves, so that friction has no sign there of rounding's making."""
    slowest = POSITION_UNIT / path.period
    return np.where(np.abs(path.velocity) < slowest, 0.0, path.velocity)
