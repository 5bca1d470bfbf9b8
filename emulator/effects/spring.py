"""A spring on an axis that the model lacks: a hose, a cable, a counterbalance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import (
    POSITION,
    STIFFNESS,
    Exciting,
    Look,
    Need,
    Parameter,
    PartEffect,
    Start,
    StaticEffect,
)
from drivetwin.emulator.effects.ground import Ground
from drivetwin.emulator.effects.model_tree import as_written
from drivetwin.emulator.effects.waves import travel

FARTHEST = 10.0
"""Travels from the middle of a motion, at which a spring rests at most: one farther away pulls alike everywhere, an offset."""


@dataclass(frozen=True)
class Spring(PartEffect, StaticEffect):
    """Torque = -stiffness (q - rest): MuJoCo's joint spring (MuJoCo manual, joint/stiffness), beside one that the model has."""

    name: ClassVar[str] = "spring"
    family: ClassVar[str] = "rigid body"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ABSOLUTE_POSITION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WHOLE_TRAVEL, Exciting.STANDSTILLS})
    by_motion: ClassVar[str] = "slow strokes over the whole travel"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.PULL})
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffness", STIFFNESS, low=0.0),
        Parameter("rest", POSITION),
    )

    stiffness: float
    rest: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        before = float(joint.stiffness[0])
        rest = as_written(spec, joint, self.rest)
        joint.stiffness[0] = before + self.stiffness
        if self.stiffness > 0.0:
            joint.springref = (before * joint.springref + self.stiffness * rest) / joint.stiffness[0]
        return self.on(axis)

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        joint = axis.joint
        pull = joint.pull + self.stiffness * self.rest
        return replace(axis, joint=replace(joint, stiffness=joint.stiffness + self.stiffness, pull=pull))

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        return super().sizes(motion, axis) | {"rest": max(abs(self.rest), travel(motion))}

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        middle, far = float(np.mean(motion.position)), FARTHEST * travel(motion)
        return super().bounds(motion, axis) | {"rest": (middle - far, middle + far)}

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        middle, way = float(np.mean(motion.position)), travel(motion)
        small = 0.1 * float(np.sqrt(np.mean(motion.torque**2))) / (way or 1.0) or 1.0

        def compose(found: Sequence[float]) -> Spring | None:
            stiffness, pull = small * (found[0] + found[1]), small * (found[0] - found[1]) * way
            return cls(stiffness, middle + pull / stiffness) if abs(pull) < FARTHEST * way * stiffness else None

        return [Start((cls(small, middle + way), cls(small, middle - way)), compose)]

    @classmethod
    def drawn(cls, ground: Ground) -> Spring:
        rest = ground.middle + ground.draw.uniform(-0.3, 0.3) * ground.room
        return cls(ground.size(ground.motion.position - rest), rest)
