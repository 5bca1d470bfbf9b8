"""An elastic transmission: the motor, with its encoder, moves by itself on a spring and a damper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import DAMPING, NUMBER, STIFFNESS, Exciting, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.seen_deflection import stiffness_seen
from drivetwin.emulator.effects.springs import damped, springs, tenth_of_critical, too_soft
from drivetwin.emulator.effects.transmission_effect import SIDES, TransmissionEffect


@dataclass(frozen=True)
class Elasticity(TransmissionEffect):
    """Torque = stiffness (m - q) + damping (m' - q'), m the motor's angle by the gear ratio, q the joint's.

    The joint's armature is the motor's side of the spring. Of its friction, `motor_friction_share` acts on the motor: that of
    bearings, seals and mesh; the rest on the joint. Spong, ASME J. Dyn. Sys. Meas. Control 109(4), 1987.
    """

    name: ClassVar[str] = "elasticity"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    scales: ClassVar[bool] = False
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SWEEP})
    by_motion: ClassVar[str] = "a sweep of small sines through the resonance"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PLAY})
    rings: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
        Parameter("motor_friction_share", NUMBER, low=0.0, high=1.0),
    )

    stiffness: float
    damping: float = 0.0
    motor_friction_share: float = 0.0

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        damping = self.damping or tenth_of_critical(motion, self.stiffness)
        return super().sizes(motion, axis) | {"damping": damping or 1.0, "motor_friction_share": 1.0}

    def natural(self, axis: AxisDynamics) -> Elasticity | None:
        """With all friction behind the spring, as most models have it: a parameter less."""
        return replace(self, motor_friction_share=0.0) if self.motor_friction_share > 0.0 else None

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        return frozenset() if self.motor_friction_share > 0.0 else frozenset({"motor_friction_share"})

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        return too_soft(motion, self.stiffness)

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        """By how the link swings, and as stiff as a second encoder shows."""
        usual = [spring for at in np.geomspace(2.0, 80.0, 17) for spring in springs(motion, float(at), (0.05,))]
        seen = stiffness_seen(motion, axis)
        tried = [*usual, *([] if seen is None else damped(motion, seen, (0.05, 0.2)))]
        return [cls._start(spring, share) for share in SIDES for spring in tried]

    @classmethod
    def drawn(cls, ground: Ground) -> Elasticity:
        spring = ground.spring(ground.draw.uniform(12.0, 24.0), ground.draw.uniform(0.02, 0.06))
        return cls(*spring, ground.draw.uniform(0.0, 0.8))

    @classmethod
    def _start(cls, spring: tuple[float, float], share: float) -> Start:
        """What it costs grows about as its compliance."""

        def compose(found: Sequence[float]) -> Elasticity | None:
            if found[0] <= 0.0:
                return None
            softer = min(max(found[0], 0.5), 2.0)
            return cls(spring[0] / softer, spring[1] / sqrt(softer), share)

        return Start((cls(*spring, share),), compose)

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, transmission=axis.transmission.in_series(self.stiffness, self.damping, self.motor_friction_share))
