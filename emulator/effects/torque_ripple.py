"""Cogging of the motor: a torque that comes and goes with its angle, whatever the current."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion, Ripple
from drivetwin.emulator.effects.base import ANGLE, NUMBER, TORQUE, Exciting, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.motor_effect import MotorEffect
from drivetwin.emulator.effects.motor_wave import MotorWave
from drivetwin.emulator.effects.waves import amplitude_and_phase, orders, unexplained


@dataclass(frozen=True)
class TorqueRipple(MotorWave, MotorEffect):
    """Shaft torque = reported torque + amplitude sin(order * motor angle + phase), motor angle = gear ratio * joint position.

    `order` is in waves a motor turn: the least common multiple of slots and poles, or once a turn. Amplitude on the joint side.
    Holtz and Springob, IEEE Trans. Industrial Electronics 43(2), 1996.
    """

    name: ClassVar[str] = "torque_ripple"
    family: ClassVar[str] = "motor and drive"
    several: ClassVar[bool] = True
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SLOW_STROKES, Exciting.WHOLE_TRAVEL})
    by_motion: ClassVar[str] = "very slow constant velocities over some motor turns"
    by_sensor: ClassVar[str] = "a torque sensor on the joint"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", TORQUE, low=0.0),
        Parameter("order", NUMBER, low=0.5),
        Parameter("phase", ANGLE),
    )

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, ripples=(*axis.ripples, Ripple(self.amplitude, self.order, self.phase)))

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        return [cls._start(order) for order in orders(motion, axis, unexplained(motion, axis))]

    @classmethod
    def drawn(cls, ground: Ground) -> TorqueRipple:
        order = float(ground.draw.choice((1.0, 2.0, 3.0, 4.0, 6.0)))
        amplitude = sqrt(2.0) * ground.size(np.where(ground.wave(order) > 0.0, 1.0, 0.0))
        return cls(min(amplitude, 0.5 * ground.torque_rms), order, ground.phase())

    @classmethod
    def _start(cls, order: float) -> Start:
        def compose(found: Sequence[float]) -> TorqueRipple:
            amplitude, phase = amplitude_and_phase(found)
            return cls(amplitude, order, phase)

        return Start((cls(1.0, order), cls(1.0, order, 0.5 * pi)), compose)
