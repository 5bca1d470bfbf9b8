"""What an effect is: a name, a family, parameters with units and bounds, what it adds to the plant, and maybe predicts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from emulator.dynamics.replay import needed_acceleration, needed_torque


@dataclass(frozen=True)
class Unit:
    """A unit that differs between a revolute and a prismatic axis."""

    revolute: str
    prismatic: str

    def on(self, joint_type: int) -> str:
        """The unit's text for a joint of MuJoCo type `joint_type`."""
        return self.prismatic if joint_type == mujoco.mjtJoint.mjJNT_SLIDE else self.revolute


TORQUE = Unit("N·m", "N")
DAMPING = Unit("N·m·s/rad", "N·s/m")
STIFFNESS = Unit("N·m/rad", "N/m")
VELOCITY = Unit("rad/s", "m/s")
POSITION = Unit("rad", "m")
QUADRATIC = Unit("N·m·s²/rad²", "N·s²/m²")
CUBIC = Unit("N·m·s³/rad³", "N·s³/m³")
INERTIA = Unit("kg·m²", "kg")
NUMBER = Unit("1", "1")
TIME = Unit("s", "s")
FREQUENCY = Unit("Hz", "Hz")
MASS = Unit("kg", "kg")
LENGTH = Unit("m", "m")
ANGLE = Unit("rad", "rad")


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect: its name, unit, and the values that make sense."""

    name: str
    unit: Unit
    low: float = -np.inf
    high: float = np.inf


class Need(StrEnum):
    """What a motion or a recording must have, so that an effect can be told from others at all."""

    BOTH_DIRECTIONS = "both_directions"
    TWO_SPEEDS = "two_speeds"
    REVERSALS = "reversals"
    ACCELERATION = "acceleration"
    ABSOLUTE_POSITION = "absolute_position"
    WEIGHT = "weight"
    TIME = "time"
    DEMAND = "demand"


@dataclass(frozen=True)
class Effect(ABC):
    """One physical effect on one axis. Subclasses are frozen dataclasses whose fields are the parameters."""

    name: ClassVar[str]
    family: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]
    needs: ClassVar[frozenset[Need]] = frozenset()
    """Without these in the recordings it is not asked for."""
    several: ClassVar[bool] = False
    """Whether an axis may have more than one: two orders of cogging."""

    @abstractmethod
    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        """Add the effect to the plant: edit the specification about the axis's joint, or return the axis changed by it.

        Raises UserError where the joint or the model cannot have the effect.
        """

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        """A change of each parameter that changes the torque about as much as the effect itself, for a search to scale by."""
        return {one.name: abs(float(getattr(self, one.name))) or 1.0 for one in self.parameters}

    def bounds(self, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of each parameter on an axis, for a search."""
        return {one.name: (one.low, one.high) for one in self.parameters}

    def natural(self, axis: AxisDynamics) -> Effect | None:
        """The same with a parameter that nature makes a whole number at one; None where there is none, or it is one already."""
        return None

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        """Parameters that stand at such a number, and are not fitted there."""
        return frozenset()

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """How rare its size is among machines [nats]: 0 for an ordinary one."""
        return 0.0


@dataclass(frozen=True)
class Start:
    """Where a search for an effect begins: members whose predictions, each times a coefficient, add up to that of one effect.

    `compose` makes the effect of the coefficients (k,) of the k members, the nearest one with parameters in their bounds; exact
    where the torque is linear in them, a first guess elsewhere. None where the coefficients make none (a negative level).
    """

    members: tuple[AxisEffect, ...]
    compose: Callable[[Sequence[float]], AxisEffect | None]


@dataclass(frozen=True)
class AxisEffect(Effect):
    """An effect whose torque follows from the measured motion of its axis, its past included."""

    scales: ClassVar[bool] = True
    """Whether a start's members may be scaled to say how large the effect is; else they are tried as they are."""

    @abstractmethod
    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        """Additional motor torque (n,) that the effect costs on a measured motion (n,), on an axis as it is without it.

        Joint side, N·m or N.
        """

    def predict_with_joint(
        self, motion: Motion, axis: AxisDynamics
    ) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """`predict`, and how much more (n,) the joint accelerates with the effect: other axes feel that. None: as much."""
        return self.predict(motion, axis), None

    @classmethod
    @abstractmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        """Where to look for the effect in a motion: near enough to each other that a local search finds the rest."""


@dataclass(frozen=True)
class ReplayedEffect(AxisEffect):
    """An effect with which the joint moves otherwise than measured: the axis replayed with it, less the axis without."""

    @abstractmethod
    def replay(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Motor torque (n,) that the axis costs with the effect, N·m or N, and acceleration (n,) of its joint."""

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        return self.replay(motion, axis)[0] - needed_torque(motion, axis)

    def predict_with_joint(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        torque, joint = self.replay(motion, axis)
        return torque - needed_torque(motion, axis), joint - needed_acceleration(motion, axis)


@dataclass(frozen=True)
class StaticEffect(AxisEffect):
    """An effect whose torque follows from the present motion of its axis alone."""


@dataclass(frozen=True)
class DriveEffect(Effect):
    """An effect between the torque that a drive's loops ask for and the torque that it gives and reports."""

    @abstractmethod
    def respond(self, asked: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Torque given (n,) for a torque asked (n,), sampled every `period` [s]; joint side, N·m or N."""

    @classmethod
    @abstractmethod
    def candidates(cls, asked: NDArray[np.float64], given: NDArray[np.float64], period: float) -> Sequence[DriveEffect]:
        """Effects to try for a torque asked and a torque given (n,)."""


@dataclass(frozen=True)
class ModelEffect(Effect):
    """An effect on the rigid bodies, about every axis: what it costs, the inverse dynamics of the changed model tells."""


@dataclass(frozen=True)
class FrictionEffect(StaticEffect):
    """An effect that is a change of the friction law: what it costs is what the changed law resists more."""

    @abstractmethod
    def change(self, law: FrictionLaw) -> FrictionLaw:
        """The law with the effect in it."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, friction=self.change(axis.friction))

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        return self.change(axis.friction).resistance(motion) - motion.kept(axis.friction, axis.friction.resistance)
