"""Viscous friction that differs with the direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import DAMPING, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class ViscousAsymmetry(FrictionEffect):
    """torque = -(viscous + asymmetry) v for v > 0, -(viscous - asymmetry) v for v < 0 (Janot, Gautier, Brunot 2019, sec. 4)."""

    name: ClassVar[str] = "viscous_asymmetry"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.BOTH_DIRECTIONS, Need.TWO_SPEEDS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SPEED_LEVELS})
    by_motion: ClassVar[str] = "strokes at several high speeds in both directions"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PULL, Look.SLOPE})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("asymmetry", DAMPING),)

    asymmetry: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, viscous_asymmetry=self.asymmetry)

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """More than the slope would push."""
        most = max(axis.friction.viscous, 1e-9)
        return super().bounds(motion, axis) | {"asymmetry": (-most, most)}

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        most = axis.friction.viscous
        return [Start((cls(1.0),), lambda found: cls(min(max(found[0], -most), most)))]

    @classmethod
    def drawn(cls, ground: Ground) -> ViscousAsymmetry:
        sign = ground.sign()
        return cls(sign * min(ground.size(ground.motion.velocity), 0.85 * ground.axis.friction.viscous))
