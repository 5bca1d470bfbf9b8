"""What effects between motor and joint have in common: the axis is replayed with another transmission."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import mujoco

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.replay import Followed, followed
from drivetwin.emulator.effects.base import JOINT_ENCODER, ReplayedEffect

SIDES = (0.0, 0.3, 0.8)
"""Shares of the friction on the motor's side, with which a search begins; none stays none."""


@dataclass(frozen=True)
class TransmissionEffect(ReplayedEffect):
    """An effect of the transmission alone."""

    family: ClassVar[str] = "transmission"
    by_sensor: ClassVar[str] = JOINT_ENCODER
    like_errors: ClassVar[bool] = True

    @abstractmethod
    def on(self, axis: AxisDynamics) -> AxisDynamics:
        """The axis with the effect in its transmission."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return _with(self, axis)

    def replay(self, motion: Motion, axis: AxisDynamics) -> Followed:
        return followed(motion, _with(self, axis))


@lru_cache(maxsize=256)
def _with(effect: TransmissionEffect, axis: AxisDynamics) -> AxisDynamics:
    """The axis with an effect: the same object for every recording, which remembers what compiled code reads of it."""
    return effect.on(axis)
