"""A position that reaches the drive late: filtering in the encoder, a serial interface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.replay import followed
from drivetwin.emulator.effects.base import TIME, AxisEffect, Exciting, Look, Need, Parameter, Start, Strays
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class Delay(AxisEffect):
    """Reading(t) = position(t - delay), for the loops and what the drive reports; straight lines between servo periods."""

    name: ClassVar[str] = "delay"
    family: ClassVar[str] = "sensing and timing"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION, Need.TWO_SPEEDS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES, Exciting.SWEEP})
    by_motion: ClassVar[str] = "the same moves with higher accelerations and jerks"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LAG})
    rings: ClassVar[bool] = True
    like_errors: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("delay", TIME, low=0.0, high=0.05),)

    delay: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, encoder=replace(axis.encoder, delay=self.delay))

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        """The torque goes with the axis's own, later position; the other axes were read when they were there."""
        own = followed(motion, axis).torque - motion.from_others
        return np.asarray(np.interp(motion.time + self.delay, motion.time, own) - own)

    def predict_with_joint(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], Strays]:
        joint = followed(motion, axis).acceleration
        later = np.interp(motion.time + self.delay, motion.time, joint)
        return self.predict(motion, axis), Strays(later - joint, self.deflect(motion, axis))

    def deflect(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        joint = motion.position + followed(motion, axis).ahead
        return np.interp(motion.time + self.delay, motion.time, joint) - joint

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [cls._start(delay) for delay in (0.001, 0.003, 0.01)]

    @classmethod
    def drawn(cls, ground: Ground) -> Delay:
        return cls(ground.draw.uniform(0.45, 0.65) / ground.bandwidth)

    @classmethod
    def _start(cls, delay: float) -> Start:
        return Start((cls(delay),), lambda found: cls(min(delay * found[0], 0.05)) if found[0] > 0.0 else None)
