"""Weight on an axis that the model lacks: a tilted base, a counterbalance that is off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, hypot, pi, sin
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.load import Load
from drivetwin.emulator.effects.base import ANGLE, TORQUE, Exciting, Look, Need, Parameter, PartEffect, Start, StaticEffect
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class Gravity(PartEffect, StaticEffect):
    """Torque = -moment sin(q - angle): at q = angle the weight hangs in its stable rest. On a slide it is -moment, everywhere.

    Khalil and Dombre, Modeling, Identification and Control of Robots, 2002: the gravity terms of one link, without its inertia.
    """

    name: ClassVar[str] = "gravity"
    family: ClassVar[str] = "rigid body"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.WEIGHT, Need.ABSOLUTE_POSITION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WHOLE_TRAVEL, Exciting.STANDSTILLS})
    by_poses: ClassVar[bool] = True
    by_motion: ClassVar[str] = "standstills over the whole travel, approached from both sides"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PULL})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("moment", TORQUE),
        Parameter("angle", ANGLE),
    )

    moment: float
    angle: float = 0.0

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        if axis.slide:
            return replace(axis, load=Load(constant=self.moment))
        return replace(axis, load=Load(sine=self.moment * cos(self.angle), cosine=-self.moment * sin(self.angle)))

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        return super().sizes(motion, axis) | {"angle": 1.0}

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        small = 0.1 * float(np.sqrt(np.mean(motion.torque**2))) or 1.0
        if axis.slide:
            return [Start((cls(small),), lambda found: cls(small * found[0]))]
        members = (cls(small), cls(small, -0.5 * pi))
        return [Start(members, lambda found: cls(small * hypot(*found), -atan2(found[1], found[0])))]

    @classmethod
    def drawn(cls, ground: Ground) -> Gravity:
        if ground.axis.slide:
            return cls(ground.sign() * ground.size(np.ones_like(ground.motion.velocity)))
        angle = ground.phase()
        return cls(ground.size(np.sin(ground.motion.position - angle)), angle)
