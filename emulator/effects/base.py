"""What an effect is: a name, a family, parameters with units and bounds, what it adds to the plant, and maybe predicts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray


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
NUMBER = Unit("1", "1")


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect: its name, unit, and the values that make sense."""

    name: str
    unit: Unit
    low: float = -np.inf
    high: float = np.inf


@dataclass(frozen=True)
class FrictionLaw:
    """Friction of one joint as it depends on the joint's velocity alone.

    torque(v) = -[coulomb + (static_torque - coulomb) exp(-(|v|/stribeck_velocity)^exponent)] sgn(v) - viscous v,
    with `coulomb` and `viscous` changed by +-asymmetry for v > 0 and v < 0; at rest the joint holds up to the bracket.
    Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 4. N·m, N·m·s/rad, rad/s (N, N·s/m, m/s).
    """

    coulomb: float = 0.0
    coulomb_asymmetry: float = 0.0
    viscous: float = 0.0
    viscous_asymmetry: float = 0.0
    static_torque: float = 0.0
    stribeck_velocity: float = 0.0
    exponent: float = 2.0

    def resistance(self, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        """Torque against the motion, (n,) for velocities (n,); zero at rest, where stiction holds what it must."""
        speed = np.abs(velocity)
        level = self.coulomb + np.sign(velocity) * self.coulomb_asymmetry
        if self.stribeck_velocity > 0.0:
            level = level + (self.static_torque - self.coulomb) * np.exp(-((speed / self.stribeck_velocity) ** self.exponent))
        slope = self.viscous + np.sign(velocity) * self.viscous_asymmetry
        return np.sign(velocity) * level + slope * velocity


@dataclass(frozen=True)
class Effect(ABC):
    """One physical effect on one axis. Subclasses are frozen dataclasses whose fields are the parameters."""

    name: ClassVar[str]
    family: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]]

    @abstractmethod
    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, law: FrictionLaw) -> FrictionLaw:
        """Add the effect to the plant: edit the specification about the axis's joint, or return the law changed by it."""


@dataclass(frozen=True)
class StaticEffect(Effect):
    """An effect whose torque follows from the present motion of its axis alone. What others cost, only a replay tells."""

    @abstractmethod
    def predict(
        self, velocity: NDArray[np.float64], acceleration: NDArray[np.float64], law: FrictionLaw
    ) -> NDArray[np.float64]:
        """Additional motor torque (n,) that the effect costs on a measured motion (n,), in a plant that has `law` already.

        Joint side, N·m or N.
        """


@dataclass(frozen=True)
class FrictionEffect(StaticEffect):
    """An effect that is a change of the friction law: what it costs is what the changed law resists more."""

    @abstractmethod
    def change(self, law: FrictionLaw) -> FrictionLaw:
        """The law with the effect in it."""

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, law: FrictionLaw) -> FrictionLaw:
        return self.change(law)

    def predict(
        self, velocity: NDArray[np.float64], acceleration: NDArray[np.float64], law: FrictionLaw
    ) -> NDArray[np.float64]:
        return self.change(law).resistance(velocity) - law.resistance(velocity)
