"""A position that reaches the drive late: filtering in the encoder, a serial interface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import TIME, Effect, Parameter


@dataclass(frozen=True)
class Delay(Effect):
    """Reading(t) = position(t - delay), for the loops and what the drive reports; straight lines between servo periods."""

    name: ClassVar[str] = "delay"
    family: ClassVar[str] = "sensing and timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("delay", TIME, low=0.0, high=0.05),)

    delay: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, encoder=replace(axis.encoder, delay=self.delay))
