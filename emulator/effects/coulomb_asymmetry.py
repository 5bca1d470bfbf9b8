"""Coulomb friction that differs with the direction: a worn screw, a tilted seal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import TORQUE, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class CoulombAsymmetry(FrictionEffect):
    """torque = -(coulomb + asymmetry) for v > 0, +(coulomb - asymmetry) for v < 0 (Janot, Gautier, Brunot 2019, sec. 4)."""

    name: ClassVar[str] = "coulomb_asymmetry"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.BOTH_DIRECTIONS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.STANDSTILLS})
    by_motion: ClassVar[str] = (
        "the torque that just moves the axis from rest, in both directions; while sliding it is an offset"
    )
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PULL})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("asymmetry", TORQUE),)

    asymmetry: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, coulomb_asymmetry=self.asymmetry)

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """More than the level would push."""
        most = max(axis.friction.coulomb, 1e-9)
        return super().bounds(motion, axis) | {"asymmetry": (-most, most)}

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        most = axis.friction.coulomb
        return [Start((cls(1.0),), lambda found: cls(min(max(found[0], -most), most)))]

    @classmethod
    def drawn(cls, ground: Ground) -> CoulombAsymmetry:
        sign = ground.sign()
        return cls(sign * min(ground.size(np.ones_like(ground.motion.velocity)), 0.8 * ground.axis.friction.coulomb))
