"""Coulomb friction: a constant torque against the motion, and as much stiction at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import TORQUE, Exciting, FrictionEffect, Look, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class Coulomb(FrictionEffect):
    """torque = -coulomb sgn(v): MuJoCo's `frictionloss`, a constraint that holds at rest (MuJoCo manual, Computation)."""

    name: ClassVar[str] = "coulomb"
    family: ClassVar[str] = "friction"
    of_model: ClassVar[bool] = True
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SLOW_STROKES, Exciting.SPEED_LEVELS})
    by_motion: ClassVar[str] = "strokes at several constant speeds in both directions"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LEVEL})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("coulomb", TORQUE, low=0.0),)

    coulomb: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, coulomb=self.coulomb)

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        before, more = axis.friction.coulomb, cls.small(axis)
        return [Start((cls(before + more),), lambda found: cls(max(0.0, before + more * found[0])))]

    @classmethod
    def drawn(cls, ground: Ground) -> Coulomb:
        return cls(ground.changed(ground.axis.friction.coulomb, np.sign(ground.motion.velocity)))
