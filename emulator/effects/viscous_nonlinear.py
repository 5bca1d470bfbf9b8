"""Viscous friction that is not proportional to the speed: a churned lubricant, a grease that shears thin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import ClassVar

import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.effects.base import CUBIC, QUADRATIC, ROOT, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class ViscousNonlinear(FrictionEffect):
    """torque = -(quadratic |v| + cubic v²) v - root sqrt(|v|) sgn(v), beside the law's `viscous`.

    The odd polynomial of MuJoCo's joint damping (MuJoCo manual, Polynomial forces), where friction grows faster than the speed;
    the root where it grows slower. Gears have exponents on both sides of 1: Waiboer, Aarts, Jonker, ECCOMAS Multibody Dynamics,
    2005.
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
        Parameter("root", ROOT, low=0.0),
    )

    quadratic: float
    cubic: float = 0.0
    root: float = 0.0

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, quadratic=self.quadratic, cubic=self.cubic, root=self.root)

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        """A search asks for one of both forms."""
        return frozenset({"quadratic", "cubic"}) if self.root > 0.0 else frozenset({"root"})

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        slope = axis.friction.viscous - abs(axis.friction.viscous_asymmetry)
        quadratic, cubic, root = cls(1.0), cls(0.0, 1.0), cls(0.0, 0.0, 1.0)
        return [
            Start((quadratic,), lambda found: cls._within(slope, found[0], 0.0)),
            Start((cubic,), lambda found: cls._within(slope, 0.0, found[0])),
            Start((quadratic, cubic), lambda found: cls._within(slope, *found)),
            Start((root,), lambda found: cls(0.0, 0.0, found[0]) if found[0] > 0.0 else None),
        ]

    @classmethod
    def drawn(cls, ground: Ground) -> ViscousNonlinear:
        speed = ground.motion.velocity
        power = ground.draw.choice(("root", "quadratic", "cubic"))
        if power == "root":
            return cls(0.0, 0.0, ground.size(np.sqrt(np.abs(speed))))
        return cls(ground.size(np.abs(speed) * speed)) if power == "quadratic" else cls(0.0, ground.size(speed**3))

    @classmethod
    def _within(cls, slope: float, quadratic: float, cubic: float) -> ViscousNonlinear | None:
        """The nearest that pushes at no speed: slope + quadratic s + cubic s² >= 0 for all s >= 0."""
        cubic = max(cubic, 0.0)
        quadratic = max(quadratic, -2.0 * sqrt(slope * cubic))
        return cls(quadratic, cubic) if quadratic != 0.0 or cubic > 0.0 else None
