"""Friction that varies along the way: a bent screw, a gear's teeth, a dry spot each turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log, pi, sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import ANGLE, POSITION, TORQUE, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.waves import (
    FRACTIONAL,
    amplitude_and_phase,
    long_waves,
    longest,
    strongest,
    travel,
    unexplained,
)

_PERIODS = 16


@dataclass(frozen=True)
class PositionFriction(FrictionEffect):
    """Level of friction + amplitude sin(2 pi q / period + phase), q the joint's position; at most the law's `coulomb`.

    One line of the spectrum of Popovic and Goldenberg, IEEE Trans. Robotics and Automation 14(1), 1998.
    """

    name: ClassVar[str] = "position_friction"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.MOTOR_ANGLE})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WHOLE_TRAVEL})
    by_motion: ClassVar[str] = "slow strokes over the whole travel, twice from different starts"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LEVEL, Look.WAVE})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", TORQUE, low=0.0),
        Parameter("period", POSITION, low=1e-6),
        Parameter("phase", ANGLE),
    )

    amplitude: float
    period: float
    phase: float = 0.0

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, position_amplitude=self.amplitude, position_period=self.period, position_phase=self.phase)

    def natural(self, axis: AxisDynamics) -> PositionFriction | None:
        """Screws and gears vary a whole number of times a motor turn, where it is not less than once."""
        turn = 2.0 * pi / axis.gear_ratio
        whole = float(round(turn / self.period))
        return replace(self, period=turn / whole) if whole >= 1.0 and self.period * whole != turn else None

    def repeats(self, axis: AxisDynamics) -> float:
        return self.period

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        return frozenset({"period"}) if self._is_whole(axis) else frozenset()

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        return 0.0 if self._is_whole(axis) or self.period > 2.0 * pi / axis.gear_ratio else log(FRACTIONAL)

    def _is_whole(self, axis: AxisDynamics) -> bool:
        turns = 2.0 * pi / axis.gear_ratio / self.period
        return turns > 0.5 and abs(turns - round(turns)) < 1e-9 * turns

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        whole = max(2.0 * pi * travel(motion), self.period)
        return super().sizes(motion, axis) | {"period": self.period**2 / whole, "phase": 1.0}

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """A wave longer than the travel is no wave that was seen, but another level or a slope."""
        return super().bounds(motion, axis) | {"period": (1e-6, max(longest(motion), 1e-6))}

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        left = unexplained(motion, axis) * np.sign(motion.velocity)
        most, numbers = longest(motion), [*long_waves(motion), *strongest(motion, left, _PERIODS)]
        periods = dict.fromkeys(min(1.0 / number, most) for number in numbers)
        return [cls._start(axis.friction.coulomb, cls.small(axis), period) for period in periods]

    @classmethod
    def drawn(cls, ground: Ground) -> PositionFriction:
        amplitude = sqrt(2.0) * ground.size(np.ones_like(ground.motion.velocity))
        waves = ground.draw.uniform(2.5, 8.0)
        return cls(min(amplitude, 0.9 * ground.axis.friction.coulomb), ground.room / waves, ground.phase())

    @classmethod
    def _start(cls, most: float, small: float, period: float) -> Start:
        def compose(found: Sequence[float]) -> PositionFriction:
            amplitude, phase = amplitude_and_phase(found)
            return cls(min(small * amplitude, most), period, phase)

        return Start((cls(small, period), cls(small, period, 0.5 * pi)), compose)
