"""A current sensor with an offset: the motor gives a torque that the drive does not report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import TORQUE, Exciting, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.motor_effect import MotorEffect


@dataclass(frozen=True)
class TorqueOffset(MotorEffect):
    """Shaft torque = reported torque + offset; on the joint side. It costs -offset, whatever the motion."""

    name: ClassVar[str] = "torque_offset"
    family: ClassVar[str] = "motor and drive"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.BOTH_DIRECTIONS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.STANDSTILLS})
    by_motion: ClassVar[str] = "standstills approached from both sides; while sliding it is an asymmetric Coulomb friction"
    by_sensor: ClassVar[str] = "a torque sensor on the joint"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PULL})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("offset", TORQUE),)

    offset: float

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, offset=self.offset))

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [Start((cls(1.0),), lambda found: cls(found[0]))]

    @classmethod
    def drawn(cls, ground: Ground) -> TorqueOffset:
        return cls(ground.sign() * ground.size(np.ones_like(ground.motion.velocity)))
