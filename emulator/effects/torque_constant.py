"""A motor that gives another torque for its current than the drive believes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log
from typing import ClassVar

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import NUMBER, AxisEffect, Exciting, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.motor_effect import MotorEffect

_SCATTER = 0.15


@dataclass(frozen=True)
class TorqueConstant(MotorEffect):
    """Shaft torque = (1 + error) reported torque; error > 0 is a motor stronger than believed, which costs less.

    The drive gain of Gautier and Briot, ASME J. Dyn. Sys. Meas. Control 136(5), 2014.
    """

    name: ClassVar[str] = "torque_constant"
    family: ClassVar[str] = "motor and drive"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.STANDSTILLS, Exciting.SHORT_MOVES})
    by_motion: ClassVar[str] = "the same strokes against a known load, such as gravity or a payload"
    by_sensor: ClassVar[str] = "a torque sensor on the joint"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.INERTIA, Look.LEVEL})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("error", NUMBER, low=-0.9, high=9.0),)

    error: float

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, constant_error=self.error))

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """Torque constants scatter by some 10 % from motor to motor, and by 20 % with the magnets' temperature."""
        return 0.5 * (log(1.0 + self.error) / _SCATTER) ** 2

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        def compose(found: Sequence[float]) -> AxisEffect:
            share = min(max(0.5 * found[0], -9.0), 0.9)  # cls(1.0) costs half of what is needed less
            return cls(share / (1.0 - share))

        return [Start((cls(1.0),), compose)]

    @classmethod
    def drawn(cls, ground: Ground) -> TorqueConstant:
        return cls(ground.sign() * ground.share())
