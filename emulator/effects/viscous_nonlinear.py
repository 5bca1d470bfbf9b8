"""Viscous friction that is not proportional to the speed: a churned lubricant, a grease that shears thin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import CUBIC, QUADRATIC, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class ViscousNonlinear(FrictionEffect):
    """torque = -(quadratic |v| + cubic v²) v, beside the law's `viscous`; negative is less than proportional.

    The odd polynomial of MuJoCo's joint damping (MuJoCo manual, Polynomial forces).
    """

    name: ClassVar[str] = "viscous_nonlinear"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.TWO_SPEEDS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SPEED_LEVELS})
    by_motion: ClassVar[str] = "strokes at several speeds up to the highest"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.SLOPE})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("quadratic", QUADRATIC),
        Parameter("cubic", CUBIC, low=0.0),
    )

    quadratic: float
    cubic: float = 0.0

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        """Of either what costs as much at the top speed as the larger one: one that is 0 is searched as far as the other."""
        top = float(np.abs(motion.velocity).max(initial=0.0)) or 1.0
        size = max(abs(self.quadratic), self.cubic * top) or 1.0
        return {"quadratic": size, "cubic": size / top}

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, quadratic=self.quadratic, cubic=self.cubic)

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        slope = axis.friction.viscous - abs(axis.friction.viscous_asymmetry)
        quadratic, cubic = cls(1.0, 0.0), cls(0.0, 1.0)
        return [
            Start((quadratic,), lambda found: cls._within(slope, found[0], 0.0)),
            Start((cubic,), lambda found: cls._within(slope, 0.0, found[0])),
            Start((quadratic, cubic), lambda found: cls._within(slope, *found)),
        ]

    @classmethod
    def drawn(cls, ground: Ground) -> ViscousNonlinear:
        speed = ground.motion.velocity
        if ground.draw.random() < 0.5:
            return cls(ground.size(np.abs(speed) * speed))
        return cls(0.0, ground.size(speed**3))

    @classmethod
    def _within(cls, slope: float, quadratic: float, cubic: float) -> ViscousNonlinear | None:
        """The nearest that pushes at no speed: slope + quadratic s + cubic s² >= 0 for all s >= 0."""
        cubic = max(cubic, 0.0)
        quadratic = max(quadratic, -2.0 * sqrt(slope * cubic))
        return cls(quadratic, cubic) if quadratic != 0.0 or cubic > 0.0 else None
