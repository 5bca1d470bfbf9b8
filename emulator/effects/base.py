"""What an effect is: a name, a family, parameters with units and bounds, what it adds to the plant, and maybe predicts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.motion import Wave
from drivetwin.emulator.dynamics.replay import followed
from drivetwin.emulator.dynamics.unseen import unseen_change
from drivetwin.emulator.effects.ground import Ground, Site

FAMILIES = ("friction", "rigid body", "motor and drive", "transmission", "sensing and timing")
"""In the order in which torque and motion pass them: an effect is predicted on an axis that has those before it."""


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
    """A parameter of an effect: its name, unit and bounds."""

    name: str
    unit: Unit
    low: float = -np.inf
    high: float = np.inf


class Need(StrEnum):
    """What a motion or recording must have to test for an effect."""

    BOTH_DIRECTIONS = "both_directions"
    TWO_SPEEDS = "two_speeds"
    REVERSALS = "reversals"
    ACCELERATION = "acceleration"
    ABSOLUTE_POSITION = "absolute_position"
    MOTOR_ANGLE = "motor_angle"
    """The angle of the motor within a turn means the same in all recordings."""
    WEIGHT = "weight"
    TIME = "time"
    DEMAND = "demand"


class Exciting(StrEnum):
    """Motions that distinguish effects; `drivetwin excite` writes them."""

    WARM_UP = "warm_up"
    SLOW_STROKES = "slow_strokes"
    SPEED_LEVELS = "speed_levels"
    WHOLE_TRAVEL = "whole_travel"
    STANDSTILLS = "standstills"
    SMALL_REVERSALS = "small_reversals"
    SHORT_MOVES = "short_moves"
    SWEEP = "sweep"


class Look(StrEnum):
    """What the torque of an effect looks like: two effects that share a look can be mistaken for each other."""

    PULL = "hardly varies, or slowly with the position"
    INERTIA = "goes with the acceleration"
    LEVEL = "changes its sign with the direction"
    SLOPE = "grows with the speed"
    LAG = "comes late or ends short"
    PLAY = "gives way at reversals"
    WAVE = "comes and goes with the position"


JOINT_ENCODER = "an encoder on the joint, behind the transmission"
"""The sensor that distinguishes what deflects a joint from its motor."""


@dataclass(frozen=True)
class Effect(ABC):
    """One physical effect on one axis. Subclasses are frozen dataclasses whose fields are the parameters."""

    name: ClassVar[str]
    family: ClassVar[str]
    """One of `FAMILIES`."""
    parameters: ClassVar[tuple[Parameter, ...]]
    needs: ClassVar[frozenset[Need]] = frozenset()
    """Without these in the recordings it is not asked for."""
    several: ClassVar[bool] = False
    """Whether an axis may have more than one: two orders of cogging."""
    of_model: ClassVar[bool] = False
    """Whether it is another value of a parameter that the model has, which it takes the place of."""
    shown_by: ClassVar[frozenset[Exciting]] = frozenset(Exciting)
    """Motions in which it shows otherwise than others do."""
    by_poses: ClassVar[bool] = False
    """Whether it shows by how it changes with the places of the other axes."""
    by_motion: ClassVar[str] = ""
    """The motion that distinguishes it, in words."""
    by_sensor: ClassVar[str] = ""
    """The sensor that does, where there is one."""
    looks: ClassVar[frozenset[Look]] = frozenset()
    stops: ClassVar[bool] = False
    """Whether a machine with it and another effect could come to a stop."""
    rings: ClassVar[bool] = False
    """Whether loops tuned without it come near to oscillating: an axis with two such trips."""
    like_errors: ClassVar[bool] = False
    """Whether what a comparison of torques errs by looks like it: the times of samples, derivatives, reversals."""
    felt_at_home: ClassVar[bool] = False
    """Whether its own axis has to feel it: what only the axis before it feels is an effect of that one."""
    asked: ClassVar[tuple[str, ...]] = ()
    """What a kind of effects asks of its classes beside this."""

    @abstractmethod
    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        """Add the effect to the plant: edit the specification about the axis's joint, or return the axis changed by it.

        Raises UserError if the joint or the model cannot have the effect.
        """

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        """A change of each parameter that changes the torque about as much as the effect itself, for a search to scale by."""
        return {one.name: abs(float(getattr(self, one.name))) or 1.0 for one in self.parameters}

    def bounds(self, motion: Motion, axis: AxisDynamics) -> dict[str, tuple[float, float]]:
        """Lowest and highest value of each parameter on an axis, for a search."""
        return {one.name: (one.low, one.high) for one in self.parameters}

    def natural(self, axis: AxisDynamics) -> Effect | None:
        """The same with a parameter that nature makes a whole number at one; None where there is none, or it is one already."""
        return None

    def repeats(self, axis: AxisDynamics) -> float:
        """Way after which it is the same again on an axis [rad or m]; infinite where it is not."""
        return np.inf

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        """Parameters that stand at such a number, and are not fitted there."""
        return frozenset()

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """How rare its size is among machines [nats]: 0 for an ordinary size."""
        return 0.0

    @classmethod
    def suits(cls, site: Site) -> bool:
        """Whether it makes sense on an axis, and is not another effect there."""
        return site.weight > 0.0 or Need.WEIGHT not in cls.needs


@dataclass(frozen=True)
class Start:
    """Where a search for an effect begins: members whose predictions, each times a coefficient, add up to that of one effect.

    `compose` makes the effect of the coefficients (k,) of the k members, the nearest one with parameters in their bounds; exact
    where the torque is linear in them, a first guess elsewhere. None where the coefficients make none (a negative level).
    """

    members: tuple[AxisEffect, ...]
    compose: Callable[[Sequence[float]], AxisEffect | None]


@dataclass(frozen=True)
class Strays:
    """By how much a joint strays with an effect from where it is without it: acceleration and position (n,), SI; `unseen`:
    waves that pass faster than the motion was recorded.
    """

    acceleration: NDArray[np.float64]
    position: NDArray[np.float64]
    unseen: Sequence[Wave] = ()


@dataclass(frozen=True)
class AxisEffect(Effect):
    """An effect whose torque follows from the measured motion of its axis, its past included."""

    scales: ClassVar[bool] = True
    """Whether a start's members may be scaled to say how large the effect is; else they are tried as they are."""
    on_friction: ClassVar[bool] = False
    """Whether it stands on the friction before it: what it costs changes with that."""

    @abstractmethod
    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        """Additional motor torque (n,) that the effect costs on a measured motion (n,), on an axis as it is without it.

        Joint side, N·m or N.
        """

    def predict_with_joint(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], Strays | None]:
        """`predict`, and how the joint strays with the effect from where it is without: other axes feel that. None: not."""
        return self.predict(motion, axis), None

    def deflect(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64] | None:
        """How much further (n,) the joint is ahead of where the motor's encoder has it [rad or m]; None: no further."""
        return None

    @classmethod
    @abstractmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:
        """Where to look for the effect in a motion: near enough to each other that a local search finds the rest."""

    @classmethod
    def drawn(cls, ground: Ground) -> AxisEffect:
        """One of a size that matters: any of its starts, its members mixed by chance, scaled to cost a share of the torque."""
        starts = cls.starts(ground.motion, ground.axis)
        while True:
            start = starts[int(ground.draw.integers(len(starts)))]
            if not cls.scales:
                return start.members[0]
            mixed = ground.draw.standard_normal(len(start.members))
            costs = [member.predict(ground.motion, ground.axis) for member in start.members]
            scale = ground.size(np.asarray(mixed @ np.array(costs)))
            made = start.compose([float(scale * part) for part in mixed])
            if made is not None:
                return made


@dataclass(frozen=True)
class PartEffect(AxisEffect):
    """An effect in one part of the axis: it costs what the axis with it is replayed to need, and without it not.

    So every part before it and after it has its say, in whatever order they are found.
    """

    @abstractmethod
    def on(self, axis: AxisDynamics) -> AxisDynamics:
        """The axis with the effect."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return self.on(axis)

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        return followed(motion, _with(self, axis)).torque - followed(motion, axis).torque

    def predict_with_joint(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], Strays | None]:
        """The joint strays behind a transmission that yields or an encoder that errs, whichever part the effect is in."""
        changed = _with(self, axis)
        there, without = followed(motion, changed), followed(motion, axis)
        torque, unseen = there.torque - without.torque, unseen_change(motion, changed, axis)
        if not changed.strays and not unseen:
            return torque, None
        return torque, Strays(there.acceleration - without.acceleration, there.ahead - without.ahead, unseen)

    def deflect(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64] | None:
        changed = _with(self, axis)
        return followed(motion, changed).ahead - followed(motion, axis).ahead if changed.strays else None


@lru_cache(maxsize=256)
def _with(effect: PartEffect, axis: AxisDynamics) -> AxisDynamics:
    """The axis with an effect: the same object for every recording, which remembers what compiled code reads of it."""
    return effect.on(axis)


@dataclass(frozen=True)
class StaticEffect(AxisEffect):
    """An effect whose torque follows from the present motion alone, on an axis without play, springs and delays."""


@dataclass(frozen=True)
class ResistingEffect(Effect):
    """An effect with one equation, a torque by the joint's present state, for both plant and prediction."""

    @abstractmethod
    def resistance(
        self, position: NDArray[np.float64], velocity: NDArray[np.float64], time: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Torque (n,) that the motor must give for it, joint side, N·m or N.

        Of the joint at positions and velocities (n,), `time` (n,) [s] after power-on.
        """

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, resisting=(*axis.resisting, self))

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        """Additional motor torque (n,) that it costs on a measured motion (n,)."""
        return self.resistance(motion.position, motion.velocity, motion.time)


@dataclass(frozen=True)
class TorqueEffect(ResistingEffect, StaticEffect):
    """A resisting effect that varies smoothly; friction that sticks is a `FrictionEffect`."""


@dataclass(frozen=True)
class UnnamedEffect(ResistingEffect):
    """What no effect names. A patch may have it; no search proposes it, no report calls it a cause, no blind case draws it."""

    asked: ClassVar[tuple[str, ...]] = ("example",)

    @classmethod
    @abstractmethod
    def example(cls, ground: Ground) -> UnnamedEffect:
        """One of a size that matters on an axis and its motion."""


@dataclass(frozen=True)
class DriveEffect(Effect):
    """An effect between the torque that a drive's loops demand and the torque that the drive gives and reports."""

    @abstractmethod
    def respond(self, asked: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Torque given (n,) for a torque asked (n,), sampled every `period` [s]; joint side, N·m or N."""

    @classmethod
    @abstractmethod
    def candidates(cls, asked: NDArray[np.float64], given: NDArray[np.float64], period: float) -> Sequence[DriveEffect]:
        """Effects to try for a torque asked and a torque given (n,)."""

    @classmethod
    @abstractmethod
    def drawn(cls, ground: Ground) -> DriveEffect:
        """One of a size that matters on an axis and its motion."""


@dataclass(frozen=True)
class ModelEffect(Effect):
    """An effect on the rigid bodies, about every axis: its torque follows from the inverse dynamics of the changed model.

    It costs its first parameter times a polynomial of degree two in the others, its shape.
    """

    shapes: ClassVar[tuple[float, ...]]
    """Values of a shape parameter from which a search begins, one parameter at a time."""
    probe: ClassVar[float]
    """Of a shape parameter, about the middle of what is met: where the polynomial is evaluated."""
    asked: ClassVar[tuple[str, ...]] = ("shapes", "probe")

    @classmethod
    @abstractmethod
    def drawn(cls, ground: Ground) -> ModelEffect:
        """One of a size that matters on an axis and its motion."""


@dataclass(frozen=True)
class FrictionEffect(StaticEffect):
    """A change of the friction law: its torque is the additional resistance of the changed law."""

    @abstractmethod
    def change(self, law: FrictionLaw) -> FrictionLaw:
        """The law with the effect in it."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, friction=self.change(axis.friction))

    def predict(self, motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
        return self.change(axis.friction).resistance(motion) - motion.kept_lately(axis.friction, axis.friction.resistance)

    def predict_with_joint(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], Strays | None]:
        """Other axes feel what passes faster than the motion was recorded."""
        law = self.change(axis.friction)
        if law.of_position == axis.friction.of_position:
            return self.predict(motion, axis), None
        unseen = unseen_change(motion, replace(axis, friction=law), axis)
        still = np.zeros_like(motion.position)
        return self.predict(motion, axis), Strays(still, still, unseen) if unseen else None

    @staticmethod
    def small(axis: AxisDynamics) -> float:
        """A tenth of the level of friction [N·m or N]: bristles give way with that much more as they do without it."""
        return 0.1 * max(axis.friction.coulomb, axis.friction.static_torque) or 1.0
