"""A current loop that is slower, or faster, than the drive was commissioned for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import FREQUENCY, Effect, Parameter


@dataclass(frozen=True)
class CurrentBandwidth(Effect):
    """Measured torque = demanded torque / (1 + s / (2 pi bandwidth)): -3 dB at `bandwidth`, in place of the commissioned lag.

    A first-order closed current loop, sampled exactly at the servo period.
    """

    name: ClassVar[str] = "current_bandwidth"
    family: ClassVar[str] = "motor and drive"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("bandwidth", FREQUENCY, low=1.0, high=4000.0),)

    bandwidth: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, bandwidth=self.bandwidth))
