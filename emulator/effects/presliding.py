"""Friction that gives way elastically before it slides: micro-displacement with hysteresis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco

from emulator.dynamics import AxisDynamics
from emulator.effects.base import DAMPING, STIFFNESS, Effect, Parameter


@dataclass(frozen=True)
class Presliding(Effect):
    """At rest the friction is a spring of `stiffness` that yields little by little until, all at its level, it slides.

    Maxwell slip with four elements of equal stiffness that slip at 1/4, 2/4, 3/4 and 4/4 of 1.6 level / stiffness, each
    damped by a quarter of `damping` while it sticks; elasto-plastic, so it does not drift. Al-Bender, Lampaert, Swevers,
    IEEE Trans. Automatic Control 50(11), 2005, without the lag of sliding friction.
    """

    name: ClassVar[str] = "presliding"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
    )

    stiffness: float
    damping: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        law = replace(axis.friction, presliding_stiffness=self.stiffness, presliding_damping=self.damping)
        return replace(axis, friction=law)
