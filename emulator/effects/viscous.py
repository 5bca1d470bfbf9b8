"""Viscous friction: a torque proportional to the speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import DAMPING, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class Viscous(FrictionEffect):
    """torque = -viscous v: MuJoCo's joint `damping`."""

    name: ClassVar[str] = "viscous"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.TWO_SPEEDS})
    of_model: ClassVar[bool] = True
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SPEED_LEVELS})
    by_motion: ClassVar[str] = "strokes at several constant speeds up to the highest"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.SLOPE})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("viscous", DAMPING, low=0.0),)

    viscous: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, viscous=self.viscous)

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        before = axis.friction.viscous
        return [Start((cls(before + 1.0),), lambda found: cls(max(0.0, before + found[0])))]

    @classmethod
    def drawn(cls, ground: Ground) -> Viscous:
        return cls(ground.changed(ground.axis.friction.viscous, ground.motion.velocity))
