"""Writes effects into a model: what MJCF can express becomes part of the model, the rest stays a separate effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from drivetwin.emulator.assembly import check_units
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.dynamics.joint import Joint
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.inertia import Inertia
from drivetwin.emulator.effects.model_tree import driven_joints
from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.motion.model_file import as_mjcf, motors_of, named_model, state_motors, state_springs

PLAIN = ("coulomb", "viscous", "quadratic", "cubic")
"""Terms of a friction law that a joint of MuJoCo has: `frictionloss` and polynomial `damping`."""


@dataclass(frozen=True)
class Change:
    """A quantity of the model that is another now; joint side, SI."""

    axis: str
    quantity: str
    before: float
    after: float
    unit: str


@dataclass(frozen=True)
class Applied:
    """The model as MJCF, what changed in it, and the effects that it cannot hold."""

    xml: str
    changes: tuple[Change, ...]
    beside: tuple[PlacedEffect, ...]


def joints_of(path: Path, axes: Sequence[str], given: Mapping[str, str]) -> dict[str, str]:
    """Joint of each axis: the one that is given, that has its name, or that an actuator of its name drives.

    Raises UserError for an axis without one, and for a given axis or joint that is not there.
    """
    _, model = named_model(path)
    joints = {model.joint(number).name: number for number in range(model.njnt) if int(model.jnt_type[number]) in _ONE_DEGREE}
    driven = {motor: joint for joint, number in joints.items() for motor in motors_of(model, number)}
    if strange := set(given) - set(axes):
        raise UserError(f"--joint {sorted(strange)[0]}=...: the file has no such axis; it has {', '.join(axes) or 'none'}")
    found = {axis: given.get(axis, axis if axis in joints else driven.get(axis, axis)) for axis in axes}
    for axis, joint in found.items():
        if joint not in joints:
            raise UserError(
                f"{path} has no hinge or slide {joint!r} for axis {axis}; it has {', '.join(joints) or 'none'}: say which it "
                f"is, --joint {axis}=JOINT"
            )
    return found


_ONE_DEGREE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def apply_effects(path: Path, joints: Mapping[str, str], effects: Sequence[PlacedEffect]) -> Applied:
    """The model of an MJCF file with effects on the axes of `joints`, by axis.

    An effect that changes nothing but the specification, or the plain friction of a joint, goes into the model. A difference
    of inertia is the joint's `armature`; where that would be less than none, the bodies that the axis carries up to the next
    driven joint get lighter, all by one share. Raises UserError for an effect that the model cannot have.
    """
    spec, model = named_model(path)
    _refuse_friction_that_is_off(path, model)
    state_motors(spec, set(joints.values()))
    state_springs(spec, model)
    before = {axis: _quantities(spec, joint, model) for axis, joint in joints.items()}
    differences: dict[str, float] = {}
    beside = []
    for axis, joint in joints.items():
        inertia, others = _parted([placed for placed in effects if placed.axis == axis], spec.joint(joint))
        differences[axis] = inertia
        beside += [placed for placed in others if not _hold(spec, joint, placed)]
    changed = _with_inertia(spec, joints, differences)
    changes = [
        Change(axis, quantity, before[axis][quantity][0], value, unit)
        for axis, joint in joints.items()
        for quantity, (value, unit) in _quantities(spec, joint, changed).items()
        if not np.isclose(value, before[axis][quantity][0], rtol=1e-9, atol=0.0)
    ]
    return Applied(as_mjcf(spec, changed), tuple(changes), tuple(beside))


def _refuse_friction_that_is_off(path: Path, model: mujoco.MjModel) -> None:
    bit = mujoco.mjtDisableBit
    for kind, name in ((bit.mjDSBL_FRICTIONLOSS, "frictionloss"), (bit.mjDSBL_DAMPER, "damper")):
        if int(model.opt.disableflags) & int(kind):
            raise UserError(f'{path}: <flag {name}="disable"/> turns off friction that is to be written: take the flag out')


def _parted(effects: Sequence[PlacedEffect], joint: mujoco.MjsJoint) -> tuple[float, list[PlacedEffect]]:
    """The difference of inertia [kg·m² or kg], and the other effects of an axis."""
    difference, others = 0.0, []
    for placed in effects:
        check_units(placed, joint)
        if isinstance(placed.effect, Inertia):
            difference += placed.effect.difference
        else:
            others.append(_with_every_unit(placed, joint))
    return difference, others


def _with_every_unit(placed: PlacedEffect, joint: mujoco.MjsJoint) -> PlacedEffect:
    """Of parameters that the file leaves out as well."""
    return replace(placed, units={one.name: one.unit.on(joint.type) for one in placed.effect.parameters})


def _hold(spec: mujoco.MjSpec, joint_name: str, placed: PlacedEffect) -> bool:
    """Write an effect into the specification, if that can hold all of it."""
    trial = spec.copy()
    axis = _axis(trial.joint(joint_name))
    after = placed.effect.add_to(trial, trial.joint(joint_name), axis)
    if _beyond_mjcf(after) != _beyond_mjcf(axis):
        return False
    joint = spec.joint(joint_name)
    law = placed.effect.add_to(spec, joint, _axis(joint)).friction
    joint.frictionloss, joint.damping = law.coulomb, (law.viscous, law.quadratic, law.cubic)
    return True


def _axis(joint: mujoco.MjsJoint) -> AxisDynamics:
    viscous, quadratic, cubic = joint.damping
    law = FrictionLaw(coulomb=joint.frictionloss, viscous=viscous, quadratic=quadratic, cubic=cubic)
    return AxisDynamics(slide=joint.type == mujoco.mjtJoint.mjJNT_SLIDE, friction=law)


def _beyond_mjcf(axis: AxisDynamics) -> AxisDynamics:
    return replace(axis, friction=replace(axis.friction, **dict.fromkeys(PLAIN, 0.0)), joint=Joint())


def _with_inertia(
    spec: mujoco.MjSpec, joints: Mapping[str, str], differences: Mapping[str, float]
) -> mujoco.MjModel:
    """Let axes have other inertias than they have now, whatever else of the model that takes; from the tip to the base."""
    model = spec.compile()
    wanted = {joints[axis]: Model(model).inertia(joints[axis]) + more for axis, more in differences.items() if more}
    for joint in sorted(wanted, key=lambda name: -int(model.jnt_bodyid[model.joint(name).id])):
        armature = spec.joint(joint).armature + wanted[joint] - Model(model).inertia(joint)
        spec.joint(joint).armature = model.dof_armature[model.joint(joint).dofadr[0]] = max(0.0, armature)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        if armature < 0.0:
            _lighten(model, joint, wanted[joint], {model.joint(name).id for name in driven_joints(spec)})
    return model


def _lighten(model: mujoco.MjModel, joint: str, wanted: float, driven: set[int]) -> None:
    """Scale what the axis carries so that its inertia is `wanted`; raises UserError where nothing would be left."""
    bodies = _carried(model, model.joint(joint).id, driven)
    mass, inertia = model.body_mass[bodies].copy(), model.body_inertia[bodies].copy()

    def with_share(share: float) -> float:
        model.body_mass[bodies], model.body_inertia[bodies] = share * mass, share * inertia
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return Model(model).inertia(joint)

    whole, half = with_share(1.0), with_share(0.5)
    share = 1.0 - (whole - wanted) / (2.0 * (whole - half)) if whole > half else 0.0
    if share <= 0.0:
        raise UserError(
            f"joint {joint!r}: an inertia of {wanted:g} is less than what the axis carries beyond its own links: is the file "
            "of this model?"
        )
    with_share(share)


def _carried(model: mujoco.MjModel, joint: int, driven: set[int]) -> list[int]:
    """Bodies that a joint moves, up to where the next driven joint begins."""
    first = int(model.jnt_bodyid[joint])
    carried = {first}
    for body in range(first + 1, model.nbody):
        own = range(int(model.body_jntadr[body]), int(model.body_jntadr[body]) + int(model.body_jntnum[body]))
        if int(model.body_parentid[body]) in carried and not driven.intersection(own):
            carried.add(body)
    return sorted(carried)


def _quantities(spec: mujoco.MjSpec, name: str, model: mujoco.MjModel) -> dict[str, tuple[float, str]]:
    """What MJCF says of an axis that a user asks for, with units."""
    joint = spec.joint(name)
    slide = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
    torque, speed, inertia = ("N", "m/s", "kg") if slide else ("N·m", "rad/s", "kg·m²")
    damping = "N·s/m" if slide else "N·m·s/rad"
    bodies = _carried(model, model.joint(name).id, {model.joint(other).id for other in driven_joints(spec)})
    return {
        "frictionloss": (float(joint.frictionloss), torque),
        "damping": (float(joint.damping[0]), damping),
        "quadratic damping": (float(joint.damping[1]), f"{torque}/({speed})²"),
        "cubic damping": (float(joint.damping[2]), f"{torque}/({speed})³"),
        "stiffness": (float(joint.stiffness[0]), "N/m" if slide else "N·m/rad"),
        "armature": (float(joint.armature), inertia),
        "mass carried": (float(model.body_mass[bodies].sum()), "kg"),
    }
