"""Where an effect finds what it needs in a MuJoCo specification: driven joints, bodies of a chain, units of angles."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count
from math import pi

import mujoco


def driven_joints(spec: mujoco.MjSpec) -> set[str]:
    """Names of the joints that actuators drive."""
    kinds = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    return {actuator.target for actuator in spec.actuators if actuator.trntype in kinds}


def free_name(wanted: str, taken: Iterable[str]) -> str:
    """`wanted`, or with a number after it where that name is taken."""
    names = set(taken)
    numbered = (f"{wanted}_{number}" for number in count(2))
    return wanted if wanted not in names else next(name for name in numbered if name not in names)


def driven_joint_before(spec: mujoco.MjSpec, joint: mujoco.MjsJoint) -> mujoco.MjsJoint | None:
    """The nearest driven joint between `joint` and the world."""
    driven = driven_joints(spec)
    body = joint.parent
    before = [other for other in body.joints if other.name != joint.name]
    while body is not None:
        for other in reversed(before):
            if other.name in driven:
                return other
        body = body.parent
        before = list(body.joints) if body is not None else []
    return None


def outermost(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> mujoco.MjsBody:
    """Down the chain from `body`, to where it ends, branches, or another driven joint begins."""
    driven = driven_joints(spec)
    while len(body.bodies) == 1 and not any(joint.name in driven for joint in body.bodies[0].joints):
        body = body.bodies[0]
    return body


def as_written(spec: mujoco.MjSpec, joint: mujoco.MjsJoint, position: float) -> float:
    """A joint position [rad or m] in the unit in which the specification holds it: degrees on a hinge, unless told."""
    in_degrees = spec.compiler.degree and joint.type == mujoco.mjtJoint.mjJNT_HINGE
    return position * 180.0 / pi if in_degrees else position


def position_of(spec: mujoco.MjSpec, joint: mujoco.MjsJoint, written: float) -> float:
    """The reverse of `as_written`."""
    return written / as_written(spec, joint, 1.0)


def clear_defaults(element: mujoco.MjsJoint | mujoco.MjsTendon) -> None:
    """Take off a new joint or tendon what the model's default class gives each: friction, inertia, spring, limits."""
    element.damping, element.stiffness = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    element.frictionloss = element.armature = element.springyield = 0.0
    element.limited = element.actfrclimited = mujoco.mjtLimited.mjLIMITED_FALSE
