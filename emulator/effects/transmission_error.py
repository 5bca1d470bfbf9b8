"""A gear whose ratio is not quite constant: teeth and wave generator that are not quite round."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import ANGLE, NUMBER, POSITION, Effect, Parameter


@dataclass(frozen=True)
class TransmissionError(Effect):
    """q = motor angle / gear ratio + amplitude sin(order * gear ratio * q + phase); rigid, or behind `elasticity`.

    `order` is in waves a motor turn, 2 for a strain wave gear. Torque and rotor inertia act by the ratio of the moment (virtual
    work). Tuttle and Seering, IEEE Trans. Robotics and Automation 12(3), 1996.
    """

    name: ClassVar[str] = "transmission_error"
    family: ClassVar[str] = "transmission"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", POSITION, low=0.0),
        Parameter("order", NUMBER, low=1e-6),
        Parameter("phase", ANGLE),
    )

    amplitude: float
    order: float = 2.0
    phase: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        error = {"error_amplitude": self.amplitude, "error_order": self.order, "error_phase": self.phase}
        return replace(axis, transmission=replace(axis.transmission, **error))
