"""Inertia of an axis that differs from the model's: a heavier coupling, a motor of another series."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import INERTIA, Exciting, Look, Need, Parameter, PartEffect, Start, StaticEffect
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class Inertia(PartEffect, StaticEffect):
    """torque = difference * acceleration: added to the joint's `armature`, on the joint side."""

    name: ClassVar[str] = "inertia"
    family: ClassVar[str] = "rigid body"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    of_model: ClassVar[bool] = True
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES, Exciting.SWEEP})
    by_motion: ClassVar[str] = "accelerations without a change of speed range: short moves of several accelerations"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.INERTIA})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("difference", INERTIA),)

    difference: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        joint.armature += self.difference
        return self.on(axis)

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, joint=replace(axis.joint, inertia=axis.joint.inertia + self.difference))

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        small = 0.1 * float(np.median(motion.inertia)) or 1.0
        return [Start((cls(small),), lambda found: cls(small * found[0]))]

    @classmethod
    def drawn(cls, ground: Ground) -> Inertia:
        return cls(ground.changed(ground.rotor, ground.motion.acceleration, floor=0.2) - ground.rotor)
