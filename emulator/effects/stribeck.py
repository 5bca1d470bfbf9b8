"""Stribeck effect: friction that falls from its static level to Coulomb's as the lubricant film builds up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import NUMBER, TORQUE, VELOCITY, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.waves import top_speed

_FASTEST = 0.3
"""Of the top speed, by which friction has fallen."""
_MOST = 2.0
"""Times the largest torque beyond that of the bodies, which static friction may be: an axis that moves was torn off."""


@dataclass(frozen=True)
class Stribeck(FrictionEffect):
    """torque = -(static_torque - coulomb) exp(-(|v|/stribeck_velocity)^exponent) sgn(v), beside the law's `coulomb`.

    Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 4 (exponent 2: the Gaussian form).
    """

    name: ClassVar[str] = "stribeck"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.TWO_SPEEDS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SLOW_STROKES})
    by_motion: ClassVar[str] = "slow constant-velocity strokes, below a tenth of the top speed"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LEVEL})
    on_friction: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("static_torque", TORQUE, low=0.0),
        Parameter("stribeck_velocity", VELOCITY, low=1e-6),
        Parameter("exponent", NUMBER, low=0.3, high=4.0),
    )

    static_torque: float
    stribeck_velocity: float
    exponent: float = 2.0

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(
            law,
            static_torque=self.static_torque,
            stribeck_velocity=self.stribeck_velocity,
            exponent=self.exponent,
        )

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """Exponents that were measured lie between 0.5 and 2 (Armstrong-Helouvry et al. 1994, sec. 3.2); friction that still
        falls at the top speed is another level, not a fall, and one that rises is none."""
        usual = super().bounds(motion, axis)
        slowest = usual["stribeck_velocity"][0]
        seen = _MOST * float(np.abs(motion.torque - motion.rigid_torque).max(initial=0.0))
        return usual | {
            "static_torque": (axis.friction.coulomb, max(seen, 2.0 * axis.friction.coulomb)),
            "stribeck_velocity": (slowest, max(_FASTEST * top_speed(motion), 2.0 * slowest)),
            "exponent": (0.5, 3.0),
        }

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        velocities = np.maximum(np.geomspace(0.005, _FASTEST, 8) * top_speed(motion), 1e-6)
        more = cls.small(axis)
        return [cls._start(axis.friction.coulomb, more, float(at), power) for at in velocities for power in (1.0, 2.0)]

    @classmethod
    def drawn(cls, ground: Ground) -> Stribeck:
        speed = ground.draw.uniform(0.015, 0.06) * ground.max_speed
        more = ground.size(np.exp(-((ground.motion.velocity / speed) ** 2)))
        coulomb = ground.axis.friction.coulomb
        static = coulomb + float(np.clip(more, 0.3 * coulomb, 1.8 * coulomb))
        return cls(static, speed, float(ground.draw.choice((1.0, 2.0))))

    @classmethod
    def _start(cls, coulomb: float, more: float, velocity: float, exponent: float) -> Start:
        def compose(found: Sequence[float]) -> Stribeck | None:
            return cls(coulomb + more * found[0], velocity, exponent) if found[0] > 0.0 else None

        return Start((cls(coulomb + more, velocity, exponent),), compose)
