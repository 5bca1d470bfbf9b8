"""Elasticity of the belts: the joints that follow an axis hang on springs instead of following it exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import mujoco

from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects.base import DAMPING, STIFFNESS, Effect, Parameter
from drivetwin.emulator.effects.model_tree import position_of
from drivetwin.foundation.errors import UserError


@dataclass(frozen=True)
class BeltElasticity(Effect):
    """Torque on each joint that follows the axis = -stiffness s - damping s', s = what it lags behind its belt.

    s = q_follower - c0 - c1 q_leader by the belt's equality, which this spring takes the place of; the leader bears c1 times
    the same torque. The linear spring of an elastic joint: Spong, ASME J. Dyn. Sys. Meas. Control 109(4), 1987.
    """

    name: ClassVar[str] = "belt_elasticity"
    family: ClassVar[str] = "transmission"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
    )

    stiffness: float
    damping: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        belts = [equality for equality in spec.equalities if _is_belt_of(equality, joint)]
        if not belts:
            raise UserError(f"{self.name}: no joint follows {joint.name!r} by an equality of the model, so it drives no belt")
        for belt in belts:
            self._soften(spec, belt)
        return axis

    def _soften(self, spec: mujoco.MjSpec, belt: mujoco.MjsEquality) -> None:
        """A fixed tendon along the equality, which stays in the model unused: it still tells who follows whom."""
        follower, leader = spec.joint(belt.name1), spec.joint(belt.name2)
        offset, ratio = belt.data[0], belt.data[1]
        spring = spec.add_tendon(name=f"{belt.name}_spring")
        spring.wrap_joint(follower.name, 1.0)
        spring.wrap_joint(leader.name, -ratio)
        spring.stiffness[0], spring.damping[0] = self.stiffness, self.damping
        at_rest = [position_of(spec, joint, joint.ref) for joint in (follower, leader)]
        spring.springlength[:] = at_rest[0] + offset - ratio * at_rest[1]
        belt.active = False


def _is_belt_of(equality: mujoco.MjsEquality, leader: mujoco.MjsJoint) -> bool:
    return bool(equality.type == mujoco.mjtEq.mjEQ_JOINT and equality.active and equality.name2 == leader.name)
