"""Inertia that an axis shares with the axis before it: a rotor or a pulley that turns with both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco

from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects.base import INERTIA, NUMBER, Exciting, Look, ModelEffect, Need, Parameter
from drivetwin.emulator.effects.ground import Ground, Site
from drivetwin.emulator.effects.model_tree import clear_defaults, driven_joint_before, free_name
from drivetwin.foundation.errors import UserError


@dataclass(frozen=True)
class Coupling(ModelEffect):
    """Torque on the axis = -inertia (a + ratio b), on the driven axis before it in the chain = -ratio inertia (a + ratio b).

    a and b are their accelerations: kinetic energy inertia (q' + ratio p')² / 2, MuJoCo's tendon `armature`. Siciliano et al.,
    Robotics, 2009, ch. 7: the rotors' part. `ratio` in units of the axis a unit of the other.
    """

    name: ClassVar[str] = "coupling"
    family: ClassVar[str] = "rigid body"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES})
    by_poses: ClassVar[bool] = True
    felt_at_home: ClassVar[bool] = True
    by_motion: ClassVar[str] = "moves of the one axis while the other holds, then both together"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.INERTIA})
    shapes: ClassVar[tuple[float, ...]] = (1.0, -1.0, 0.3, -0.3, 3.0, -3.0)
    probe: ClassVar[float] = 1.0
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("inertia", INERTIA, low=0.0),
        Parameter("ratio", NUMBER),
    )

    inertia: float
    ratio: float = 1.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        other = driven_joint_before(spec, joint)
        if other is None:
            raise UserError(f"{self.name}: no driven joint stands before {joint.name!r} in its chain; name the axis after it")
        name = free_name(f"{joint.name}_coupling", (tendon.name for tendon in spec.tendons))
        rotor = spec.add_tendon(name=name)
        clear_defaults(rotor)
        rotor.armature = self.inertia
        rotor.wrap_joint(joint.name, 1.0)
        rotor.wrap_joint(other.name, self.ratio)
        return axis

    @classmethod
    def suits(cls, site: Site) -> bool:
        """Where a hinge stands before the axis."""
        return site.number > 0 and not site.after_slide

    @classmethod
    def drawn(cls, ground: Ground) -> Coupling:
        ratio = ground.sign() * ground.draw.uniform(0.5, 1.5)
        return cls(ground.size(ground.of_bodies(cls(1e-3, ratio))) * 1e-3, ratio)
