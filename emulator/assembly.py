"""Puts motors, gears and effects into a MuJoCo specification, and says what each axis is then."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.model_tree import clear_defaults
from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.motion.model_file import ON_JOINT, working_spec


@dataclass(frozen=True)
class DrivenJoint:
    """How a joint of a MuJoCo model is driven: by which actuator, through which gear, with what on the motor's shaft.

    `gear_ratio`: motor turns a joint turn, or rad/m; rotor inertia [kg·m²] and holding brake [N·m] on the shaft; `position`:
    where the joint stands at first [rad or m]. A joint's `armature`, where the model has one, is all of the motor's inertia
    at the joint: the rotor's counts where there is none.
    """

    joint: str
    actuator: str
    gear_ratio: float
    rotor_inertia: float
    holding_brake: float
    position: float


def working_plant(path: Path, drives: Mapping[str, DrivenJoint], period: float) -> mujoco.MjSpec:
    """The specification of an MJCF file as a plant of these drives at time steps of `period` [s].

    A motor is on each axis, whatever drives it in the file. Joints that neither are an axis nor follow one by an equality stand
    at qpos0, as they do for the diagnosis; those that follow do so rigidly. Contacts, shapes and what watches have no part in
    it. Raises UserError for an axis that is on no hinge or slide of it.
    """
    spec = working_spec(path, partial(_give_motors, path, drives))
    model = spec.compile()
    moving = np.abs(Model(model, path).ratios([drive.joint for drive in drives.values()])).sum(axis=1) > 0.0
    _let_stand(spec, {model.joint(number).name for number in range(model.njnt) if moving[int(model.jnt_dofadr[number])]})
    spec.option.timestep = period
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    for equality in spec.equalities:
        equality.solref, equality.solimp[:3] = (2.0 * period, 1.0), (0.9999, 0.9999, 0.001)
    for joint in spec.joints:
        _make_it_stick(joint, period)
    return spec


def _let_stand(spec: mujoco.MjSpec, moving: set[str]) -> None:
    """Take out every joint that no axis moves, and what holds or drives it."""
    still = {joint.name for joint in spec.joints} - moving
    driven = {actuator.target for actuator in spec.actuators}
    for tendon in list(spec.tendons):
        if any(wrap.target is not None and wrap.target.name in still for wrap in tendon.path):
            spec.delete(tendon)
    for equality in list(spec.equalities):
        if {equality.name1, equality.name2} & still:
            spec.delete(equality)
    for actuator in list(spec.actuators):
        if actuator.target in still & driven:
            spec.delete(actuator)
    for joint in list(spec.joints):
        if joint.name in still:
            spec.delete(joint)


def _give_motors(path: Path, drives: Mapping[str, DrivenJoint], spec: mujoco.MjSpec) -> None:
    joints = {joint.name for joint in spec.joints if joint.type in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)}
    for axis, drive in drives.items():
        if drive.joint not in joints:
            named = ", ".join(sorted(joints)) or "none"
            raise UserError(f"{path}: axis {axis} moves joint {drive.joint!r}; the model's hinges and slides: {named}")
        for actuator in spec.actuators:
            if actuator.name == drive.actuator or (actuator.trntype in ON_JOINT and actuator.target == drive.joint):
                spec.delete(actuator)
        motor = spec.add_actuator(name=drive.actuator, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=drive.joint)
        motor.set_to_motor()
        motor.ctrllimited = motor.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE


def assemble(
    spec: mujoco.MjSpec, drives: Mapping[str, DrivenJoint], effects: tuple[PlacedEffect, ...]
) -> dict[str, AxisDynamics]:
    """Change the specification; each axis as it is with its effects, in the order of `drives`.

    Raises UserError for an effect on an axis that is not there, in a wrong unit, or that makes no mechanism.
    """
    if unknown := {placed.axis for placed in effects} - set(drives):
        raise UserError(f"the effects name axis {sorted(unknown)[0]!r}; machine {spec.modelname} has {', '.join(drives)}")
    axes = {name: _add_effects(spec, name, drive, effects) for name, drive in drives.items()}
    for name, axis in axes.items():
        if axis.transmission.elastic:
            _free_the_motor(spec, name, drives[name], axis)
    return axes


def _add_effects(spec: mujoco.MjSpec, name: str, drive: DrivenJoint, effects: tuple[PlacedEffect, ...]) -> AxisDynamics:
    joint = spec.joint(drive.joint)
    joint.armature = joint.armature or drive.rotor_inertia * drive.gear_ratio**2
    spec.actuator(drive.actuator).gear[0] = drive.gear_ratio
    viscous, quadratic, cubic = joint.damping
    law = FrictionLaw(coulomb=joint.frictionloss, viscous=viscous, quadratic=quadratic, cubic=cubic)
    axis = AxisDynamics(drive.gear_ratio, slide=joint.type == mujoco.mjtJoint.mjJNT_SLIDE, friction=law)
    for placed in effects:
        if placed.axis == name:
            check_units(placed, joint)
            axis = placed.effect.add_to(spec, joint, axis)
    _check_axis(name, joint, axis)
    _resist(joint, axis.friction.scaled(1.0 - axis.transmission.motor_friction_share))
    _make_it_stick(joint, spec.option.timestep)
    return axis


def _resist(joint: mujoco.MjsJoint, law: FrictionLaw) -> None:
    joint.damping = (law.viscous, law.quadratic, law.cubic)
    joint.frictionloss = law.coulomb


def _make_it_stick(joint: mujoco.MjsJoint, period: float) -> None:
    """As stiff as the time step bears: MuJoCo's own default creeps under a torque below the friction."""
    joint.solref_friction = (2.0 * period, 1.0)
    joint.solimp_friction[:3] = (0.9999, 0.9999, 0.001)


def _free_the_motor(spec: mujoco.MjSpec, name: str, drive: DrivenJoint, axis: AxisDynamics) -> None:
    """The rotor, which was the joint's armature, on a joint of its own; an unused equality tells that it follows the axis."""
    joint = spec.joint(drive.joint)
    if joint.armature <= 0.0:
        raise UserError(f"axis {name}: an elastic transmission needs a motor's inertia; give joint {joint.name!r} an armature")
    body = spec.worldbody.add_body(
        name=motor_joint(drive),
        ipos=(0.0, 0.0, 0.0),
        mass=joint.armature,
        inertia=(joint.armature, joint.armature, joint.armature),
        explicitinertial=True,
        gravcomp=1.0,
    )
    motor = body.add_joint(name=motor_joint(drive), type=joint.type, ref=joint.ref)
    clear_defaults(motor)
    _resist(motor, axis.friction.scaled(axis.transmission.motor_friction_share))
    _make_it_stick(motor, spec.option.timestep)
    joint.armature = 0.0
    spec.actuator(drive.actuator).target = motor.name
    follows = spec.add_equality(
        name=motor.name, type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=motor.name, name2=joint.name
    )
    follows.data[:2] = (0.0, 1.0)
    follows.active = False


def motor_joint(drive: DrivenJoint) -> str:
    """Name of the joint of a motor that moves by itself."""
    return f"{drive.joint}_motor"


def check_units(placed: PlacedEffect, joint: mujoco.MjsJoint) -> None:
    """Raises UserError where a parameter is given in another unit than its joint has."""
    for parameter in placed.effect.parameters:
        expected = parameter.unit.on(joint.type)
        given = placed.units.get(parameter.name, expected)
        if given != expected:
            raise UserError(
                f"{placed.effect.name} on axis {placed.axis!r}: {parameter.name} is given in {given!r}, expected {expected!r}"
            )


def _check_axis(name: str, joint: mujoco.MjsJoint, axis: AxisDynamics) -> None:
    """What no machine is: friction that drives its joint, less than no inertia, a gear that runs backwards on its way."""
    law, gear = axis.friction, axis.transmission
    for level, less in (("coulomb", "coulomb_asymmetry"), ("viscous", "viscous_asymmetry"), ("coulomb", "position_amplitude")):
        if abs(getattr(law, less)) > getattr(law, level):
            raise UserError(
                f"axis {name}: {less} {getattr(law, less):g} is more than {level} {getattr(law, level):g}: it would push"
            )
    if law.least_slope < 0.0:
        terms = f"viscous {law.viscous:g}, quadratic {law.quadratic:g} and cubic {law.cubic:g}"
        raise UserError(f"axis {name}: {terms} together would push at some speed")
    if joint.armature < 0.0:
        raise UserError(f"axis {name}: inertia takes more off than the armature of joint {joint.name!r} is")
    if abs(gear.error_amplitude) * gear.error_order * axis.gear_ratio >= 1.0:
        raise UserError(f"axis {name}: a transmission error of {gear.error_amplitude:g} would turn the joint back on its way")


def check_time_step(
    axes: Mapping[str, AxisDynamics], rotors: Sequence[float], inertia: NDArray[np.float64], period: float
) -> None:
    """Raises UserError for springs and dampers that a time step [s] cannot follow; rotors and whole axes [kg·m² or kg]."""
    for (name, axis), rotor, whole in zip(axes.items(), rotors, inertia, strict=True):
        friction, gear = axis.friction, axis.transmission
        _check_spring(f"axis {name}: presliding", friction.presliding_stiffness, friction.presliding_damping, whole, period)
        if gear.elastic:
            between = 1.0 / (1.0 / rotor + 1.0 / (whole - rotor))
            _check_spring(f"axis {name}: transmission", gear.stiffness, gear.damping, between, period)
            motor = friction.scaled(gear.motor_friction_share)
            where = f"axis {name}: presliding on the motor"
            _check_spring(where, motor.presliding_stiffness, motor.presliding_damping, rotor, period)


def _check_spring(where: str, stiffness: float, damping: float, inertia: float, period: float) -> None:
    most = (inertia / period**2, 0.5 * inertia / period)
    for name, given, bound in (("stiffness", stiffness, most[0]), ("damping", damping, most[1])):
        if given > bound:
            raise UserError(f"{where}: {name} {given:g} is more than a time step of {period:g} s follows, {bound:.3g} at most")
