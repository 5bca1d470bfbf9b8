"""Effects between the torque that a drive reports and the one that its motor's shaft gives: each bends what the others cost."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.effects.base import StaticEffect


@dataclass(frozen=True)
class MotorEffect(StaticEffect):
    """A change of the motor: it costs what the drive then reports for the same torque of the shaft, and did not before."""

    @abstractmethod
    def change(self, axis: AxisDynamics) -> AxisDynamics:
        """The axis with the effect in its motor."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return self.change(axis)

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        shaft = motor_torque(motion, axis)
        return self.change(axis).reported(shaft, motion) - axis.reported(shaft, motion)
