"""Play between motor and joint: they meet on one flank or the other, and part in between."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import DAMPING, POSITION, STIFFNESS, Effect, Parameter


@dataclass(frozen=True)
class Backlash(Effect):
    """Torque = 0 while |m - q| < gap / 2, else stiffness (|m - q| - gap / 2) sgn(m - q) + damping (m' - q'), which never pulls.

    m, q and the sides of armature and friction as with `elasticity`, whose compliance adds. `gap` is the whole lost motion.
    The dead zone of Nordin and Gutman, Automatica 38(10), 2002.
    """

    name: ClassVar[str] = "backlash"
    family: ClassVar[str] = "transmission"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("gap", POSITION, low=0.0),
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
    )

    gap: float
    stiffness: float
    damping: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        meshing = axis.transmission.in_series(self.stiffness, self.damping)
        return replace(axis, transmission=replace(meshing, gap=self.gap))
