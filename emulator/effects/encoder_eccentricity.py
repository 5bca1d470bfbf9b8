"""An encoder disc that is not centred on its shaft: the reading errs once a motor turn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import ANGLE, POSITION, Effect, Parameter


@dataclass(frozen=True)
class EncoderEccentricity(Effect):
    """Reading = position + amplitude sin(motor angle + phase), on the joint side; on the motor's, gear ratio times that.

    A disc of radius r that sits e off errs by e / r on the motor's shaft: HEIDENHAIN, Rotary Encoders, accuracy.
    """

    name: ClassVar[str] = "encoder_eccentricity"
    family: ClassVar[str] = "sensing and timing"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", POSITION, low=0.0),
        Parameter("phase", ANGLE),
    )

    amplitude: float
    phase: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, encoder=replace(axis.encoder, eccentricity=self.amplitude, phase=self.phase))
