"""A motor whose iron saturates: the more current it has, the less torque another ampere gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.replay import motor_torque
from drivetwin.emulator.effects.base import TORQUE, AxisEffect, Exciting, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.motor_effect import MotorEffect

_SCATTER = 0.15
"""Of the torque that a motion asks at most, what most motors take more current for, at most."""


@dataclass(frozen=True)
class MagneticSaturation(MotorEffect):
    """Reported torque = S (1 + (S / knee)²) for a shaft torque S: at the knee the motor takes twice the current.

    The first term beside the linear one of any characteristic that is the same in both directions. A curve of a servo motor
    by a load cell: Pieper, Dealing with stator magnetic saturation, mjbots, 2020.
    """

    name: ClassVar[str] = "magnetic_saturation"
    family: ClassVar[str] = "motor and drive"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES})
    by_motion: ClassVar[str] = "the same strokes at several accelerations, up to the torque limit"
    by_sensor: ClassVar[str] = "a torque sensor on the joint"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.INERTIA, Look.LEVEL})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("knee", TORQUE, low=1e-6),)

    knee: float

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, knee=self.knee))

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """Drives are sized so that a motor saturates little at the torque that a motion asks."""
        return 0.5 * ((_highest(motion, axis) / self.knee) ** 2 / _SCATTER) ** 2

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        highest = _highest(motion, axis)

        def compose(found: Sequence[float]) -> AxisEffect | None:
            return cls(highest / found[0] ** 0.5) if found[0] > 0.0 else None

        return [Start((cls(highest),), compose)]

    @classmethod
    def drawn(cls, ground: Ground) -> MagneticSaturation:
        once = cls(_highest(ground.motion, ground.axis))
        return cls(once.knee / ground.size(once.predict(ground.motion, ground.axis)) ** 0.5)


def _highest(motion: Motion, axis: AxisDynamics) -> float:
    """Torque that a motion asks at most, as the drive reports it, a few outliers aside [N·m or N]."""
    return float(np.quantile(np.abs(motor_torque(motion, axis)), 0.999)) or 1.0
