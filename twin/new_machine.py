"""A machine from a robot's model: what can be derived about drives and motion, and what had to be assumed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import inf, pi
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.machine_file import MOST_AXES
from drivetwin.foundation.quantities import quantity, short, span
from drivetwin.identification.result import UNITS, Units
from drivetwin.motion.coupled_motion import check_axes_move_alone, friction_of_followers
from drivetwin.motion.followers import relations_of
from drivetwin.motion.inverse_dynamics import JointKind, Model
from drivetwin.motion.model_file import ON_JOINT, as_mjcf, motors_of, state_motors, state_springs
from drivetwin.twin.urdf import read_robot

Array = NDArray[np.float64]

UNNAMED = "MuJoCo Model"
"""What MuJoCo calls a model that its file does not name."""
POSES = 64
"""In which inertia and weight of an axis are asked for, drawn within the travel of all."""
TURN, STROKE = pi, 0.25
"""Half the travel of a hinge [rad] and a slide [m] that the model does not limit."""
CROSSING, FASTEST_TURN, FASTEST_STROKE = 0.8, 2.0, 0.5
"""Seconds in which an axis crosses its travel, and the most that it then moves [rad/s, m/s]."""
SPEEDING = 0.15
"""Seconds to full speed."""
STOPPING = 0.005
"""Of the room between the ends, half the way from a limit switch to its end: in it a search for the switch stops."""
VISCOUS = 0.5
"""Most of what an actuator has left for motion that viscous friction may take: beyond it, the axis is slower."""
HINGE_GEAR, SCREW = 50, 0.01
"""Gear of a hinge, and lead of a slide's screw [m a turn], where the model's actuator has none."""
MOST_BANDWIDTH = 60.0
"""Of a velocity loop in the pose of the least inertia [Hz]: current loop and speed filter bear no more."""
APART = 2.5
"""Width of the velocity loop at the largest inertia, in that of the position loop."""
ROTOR = 0.1
"""Inertia of a rotor at the joint, as a share of the axis's largest, where the model has no armature."""
RESERVE = 1.3
"""Of the torque that weight and the quickest move need."""
ROTOR_ACCELERATION = 1e5
"""Of a servo motor's rotor by itself, at peak torque [rad/s²]: an axis that is nearly all friction needs a motor, too."""
SMALLEST_MOTOR, LARGEST_MOTOR = 0.001, 4e6
"""Rated torque [N·m]: 6076h counts in mN·m, in 32 bits."""
FASTEST_MOTOR = 1e4
"""Speed that a motor may have behind its gear [rad/s]."""
FURTHEST, SHORTEST = 20.0, 1e-5
"""Positions of an axis, and the room between its ends, at most and at least [rad or m]: 32 bits hold ±21 in units of 1e-8."""
OVERSIZED = 10.0
"""Most that an axis's motor can give, in torques that it needs: a limit beyond is what files say that know none."""
PEAK = 3.0
"""Peak torque of a motor, in rated torques."""
SENSOR = {"noise": 0.004, "resolution": 0.0005}
INCREMENTS = 1048576
FILTER_HZ, CURRENT_LAG = 300.0, 0.0005


@dataclass(frozen=True)
class NewMachine:
    """machine.yaml as a value, model.xml as text, and a line for everything that nobody told."""

    description: dict[str, Any]
    model_xml: str
    assumed: tuple[str, ...]


@dataclass(frozen=True)
class _Needs:
    """What an axis asks of its drive over all poses: inertia [kg·m² or kg] at most and at least, weight, its friction."""

    inertia: float
    least_inertia: float
    weight: float
    level: float
    slope: float

    def steady(self, speed: float) -> float:
        """Torque at constant speed [N·m or N] in the pose of the greatest weight."""
        return self.weight + self.level + self.slope * speed


@dataclass(frozen=True)
class _Axis:
    """An axis before its drive: where and how fast it moves, and motor and output turns with a slide's travel a turn [m]."""

    joint: str
    slide: bool
    travel: tuple[float, float]
    speed: float
    gear: tuple[int, int]
    feed: float | None

    @property
    def ratio(self) -> float:
        """Motor angle over joint position [1 or rad/m]."""
        return self.gear[0] / self.gear[1] * 2.0 * pi / (self.feed or 2.0 * pi)

    @property
    def units(self) -> Units:
        """Of its quantities."""
        return UNITS[JointKind.PRISMATIC if self.slide else JointKind.REVOLUTE]


def new_machine(path: Path, name: str | None, bandwidth: float) -> NewMachine:
    """A machine of the axes that a model's actuators drive, or of all hinges and slides where there is none, as in a URDF.

    `name` is the model's own, or its file's, unless told; `bandwidth` [Hz] is of the velocity loops. Raises UserError where
    there is no axis, or there are too many, where one moves with what no drive moves, and where a motor of the model is too
    weak for its axis.
    """
    robot = read_robot(path)
    spec, model = robot.spec, robot.model
    joints = _driven(path, model)
    rigid = Model(model, path)
    check_axes_move_alone(rigid, {joint: joint for joint in joints})
    assumed: list[str] = []
    axes = [_plan(path, model, joint, robot.speed.get(joint, inf), assumed) for joint in joints]
    state_motors(spec, set(joints))
    state_springs(spec, model)
    needs = _needs(rigid, axes)
    axes = [_slowed(model, axis, need) for axis, need in zip(axes, needs, strict=True)]
    for axis, need in zip(axes, needs, strict=True):
        _give_rotor(path, spec.joint(axis.joint), axis, need, assumed)
    driven = spec.compile()
    described = {
        axis.joint: _described(path, driven, axis, number, need, bandwidth, assumed)
        for number, (axis, need) in enumerate(zip(axes, _needs(Model(driven, path), axes), strict=True), start=1)
    }
    own = path.stem if spec.modelname in ("", UNNAMED) else spec.modelname
    description = {"schema": "machine/1", "machine": name or own, "model": "model.xml", "axes": described}
    return NewMachine(description, as_mjcf(spec, driven), tuple(assumed))


def _plan(path: Path, model: mujoco.MjModel, joint: str, fastest: float, assumed: list[str]) -> _Axis:
    slide = int(model.joint(joint).type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
    low, high = _travel(path, model, joint, slide, assumed)
    speed = min((high - low) / CROSSING, FASTEST_STROKE if slide else FASTEST_TURN, fastest)
    axis = _Axis(joint, slide, (low, high), speed, *_gear(model, joint, slide, assumed))
    if axis.ratio * speed > FASTEST_MOTOR:
        turns = f"behind a gear of {axis.ratio:.4g} its motor turns at {axis.ratio * speed:.3g} rad/s"
        raise UserError(f"{path}: joint {joint!r}: {turns}: correct the gear of its actuator")
    return axis


def _slowed(model: mujoco.MjModel, axis: _Axis, need: _Needs) -> _Axis:
    """The axis at the speed that its actuator can keep up against viscous friction, where it holds the axis at all."""
    left = _force_limit(model, axis.joint) / RESERVE - need.weight - need.level
    if left <= 0.0 or need.slope * axis.speed <= VISCOUS * left:
        return axis
    return replace(axis, speed=VISCOUS * left / need.slope)


def _peak(axis: _Axis, need: _Needs) -> float:
    """Torque at the joint [N·m or N] that takes the axis to its speed in time, and that a motor can be had for."""
    steady = need.steady(axis.speed)
    moving = RESERVE * max(steady + need.inertia * axis.speed / SPEEDING, 2.0 * steady)
    return max(moving, PEAK * SMALLEST_MOTOR * axis.ratio)


def _give_rotor(path: Path, joint: mujoco.MjsJoint, axis: _Axis, need: _Needs, assumed: list[str]) -> None:
    """The rotor of an axis, unless the model has it as armature."""
    if not joint.armature + need.inertia > 0.0:
        raise UserError(f"{path}: joint {joint.name!r} moves no mass: give the bodies behind it their mass and inertia")
    if joint.armature > 0.0:
        return
    share, motors = ROTOR * need.inertia, _peak(axis, need) * axis.ratio / ROTOR_ACCELERATION
    joint.armature = max(share, motors)
    why = f"{ROTOR:.0%} of the axis's largest inertia" if share >= motors else "the rotor of a motor of its torque"
    assumed.append(f"{joint.name}: armature {quantity(joint.armature, axis.units.inertia, 3)}, {why}")


def _driven(path: Path, model: mujoco.MjModel) -> list[str]:
    """Names of the joints that are axes, in the order of the model."""
    one_degree = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    every = [number for number in range(model.njnt) if int(model.jnt_type[number]) in one_degree]
    follow = {relation.joints[0] for relation in relations_of(model)}
    free = [number for number in every if number not in follow]
    driven = [number for number in every if motors_of(model, number)] or (free if not model.nu else [])
    if not driven:
        raise UserError(f"{path}: no actuator drives a hinge or a slide: give the joints that a drive moves a <motor>")
    if len(driven) > MOST_AXES:
        raise UserError(f"{path}: {len(driven)} joints are driven, a machine has {MOST_AXES} axes at most: leave some out")
    if nameless := [number for number in driven if not model.joint(number).name]:
        raise UserError(f"{path}: joint number {nameless[0]} has no name, by which its axis would be called: give it one")
    return [model.joint(number).name for number in driven]


def _travel(path: Path, model: mujoco.MjModel, joint: str, slide: bool, assumed: list[str]) -> tuple[float, float]:
    of, unit = model.joint(joint), "m" if slide else "rad"
    if model.jnt_limited[of.id]:
        low, high = (float(end) for end in model.jnt_range[of.id])
        if not high - low >= SHORTEST:
            raise UserError(f"{path}: joint {joint!r}: its range, {high - low:g}, is no way that a drive can tell: correct it")
        within = max(low, -FURTHEST), min(high, FURTHEST)
        if within != (low, high):
            assumed.append(f"{joint}: travel {span(*within, unit)}, of the model's range {low:g} to {high:g} {unit}")
        return within
    half = STROKE if slide else TURN
    middle = float(model.qpos0[of.qposadr[0]])
    ends = span(middle - half, middle + half, unit)
    assumed.append(f"{joint}: travel {ends}, for the model gives it no range")
    return middle - half, middle + half


def _needs(rigid: Model, axes: Sequence[_Axis]) -> list[_Needs]:
    """Over qpos0 and poses drawn within the travel."""
    model, joints = rigid.given, [axis.joint for axis in axes]
    travel = np.array([axis.travel for axis in axes])
    home = np.array([[float(model.qpos0[model.joint(joint).qposadr[0]]) for joint in joints]])
    drawn = np.random.default_rng(0).uniform(travel[:, 0], travel[:, 1], (POSES, len(joints)))
    poses = np.vstack([home, drawn])
    still = np.zeros_like(poses)
    weight = rigid.torques(joints, poses, still, still)
    dofs = [int(model.joint(joint).dofadr[0]) for joint in joints]
    theirs = friction_of_followers(model, rigid.ratios(joints), dofs)
    found = []
    for k, (dof, (level, slope)) in enumerate(zip(dofs, theirs, strict=True)):
        one = still.copy()
        one[:, k] = 1.0
        inertia = (rigid.torques(joints, poses, still, one) - weight)[:, k]
        friction = float(model.dof_frictionloss[dof]) + level, float(model.dof_damping[dof]) + slope
        found.append(_Needs(float(inertia.max()), float(inertia.min()), float(np.abs(weight[:, k]).max()), *friction))
    return found


def _described(
    path: Path, model: mujoco.MjModel, axis: _Axis, number: int, need: _Needs, bandwidth: float, assumed: list[str]
) -> dict[str, Any]:
    """One entry of `axes`."""
    joint, units, ratio, (low, high) = axis.joint, axis.units, axis.ratio, axis.travel
    room, speed = high - low, axis.speed
    peak, acceleration = _strength(path, model, axis, need, assumed)
    moved = f"speed {quantity(speed, units.velocity, 3)}, acceleration {quantity(acceleration, f'{units.velocity}²', 3)}"
    reached = min(bandwidth, MOST_BANDWIDTH * need.least_inertia / need.inertia)
    assumed.append(f"{joint}: {moved}; velocity loop of {reached:.3g} Hz at its largest inertia")
    width, slowing = 2.0 * pi * reached, 0.3 * acceleration
    switches = {"negative": low + 0.01 * room, "positive": high - 0.01 * room}
    rest = float(model.qpos0[model.joint(joint).qposadr[0]])
    motors = motors_of(model, model.joint(joint).id)
    return {
        "node_id": number,
        "joint": joint,
        "actuator": motors[0] if motors else joint,
        "gear": list(axis.gear),
        **({"feed": axis.feed} if axis.feed else {}),
        "drive": {
            "motor": {
                "rated_torque": short(max(peak / PEAK, RESERVE * need.steady(speed)) / ratio),
                "peak_torque": short(peak / ratio),
                "inertia": float(model.dof_armature[model.joint(joint).dofadr[0]] / ratio**2),
                "holding_brake": short(1.5 * need.weight / ratio),
            },
            "encoder": {"increments_per_revolution": INCREMENTS},
            "current_sensor": dict(SENSOR),
            "current_loop_time_constant": CURRENT_LAG,
            "loops": {
                "position_gain": short(width / APART),
                "velocity_gain": short(width * need.inertia),
                "integral_time": short(2.0 / width),
                "velocity_feedforward": 1.0,
                "velocity_filter_hz": FILTER_HZ,
            },
            "limit_switches": switches,
            "home_switch": {"negative": low + 0.49 * room, "positive": low + 0.51 * room},
            "power_on_position": low + 0.08 * room,
        },
        "motion": {
            "travel": [low + 0.04 * room, high - 0.04 * room],
            "rest": rest if low + 0.05 * room < rest < high - 0.05 * room else low + 0.5 * room,
            "max_speed": short(speed),
            "max_acceleration": short(acceleration),
            "homing": {
                "method": 17,
                "switch_position": switches["negative"],
                "search_speed": short(min(0.25 * speed, (2.0 * STOPPING * room * slowing) ** 0.5)),
                "edge_speed": short(0.03 * speed),
                "acceleration": short(slowing),
            },
        },
    }


def _gear(model: mujoco.MjModel, joint: str, slide: bool, assumed: list[str]) -> tuple[tuple[int, int], float | None]:
    """Motor and output turns, and a slide's travel a turn of the output [m]."""
    motors = motors_of(model, model.joint(joint).id)
    told = abs(float(model.actuator(motors[0]).gear[0])) if motors else 1.0
    if slide:
        if told > 1.0:
            return (1, 1), 2.0 * pi / told
        assumed.append(f"{joint}: a screw of {1e3 * SCREW:g} mm a turn")
        return (1, 1), SCREW
    ratio = Fraction(told).limit_denominator(1000)
    if told > 1.0:
        return (ratio.numerator, ratio.denominator), None
    assumed.append(f"{joint}: a gear of {HINGE_GEAR}:1")
    return (HINGE_GEAR, 1), None


def _strength(path: Path, model: mujoco.MjModel, axis: _Axis, need: _Needs, assumed: list[str]) -> tuple[float, float]:
    """Peak torque at the joint [N·m or N], and the acceleration that it can give beside the load at steady speed."""
    wanted, steady, unit = axis.speed / SPEEDING, need.steady(axis.speed), axis.units.torque
    needed, limit = _peak(axis, need), _force_limit(model, axis.joint)
    if needed / axis.ratio > LARGEST_MOTOR:
        motor = f"it takes a motor of {needed / axis.ratio:.3g} N·m, more than a drive can tell"
        raise UserError(f"{path}: joint {axis.joint!r}: {motor}: correct its mass, damping or frictionloss")
    if limit == inf:
        return needed, wanted
    if limit > OVERSIZED * needed:
        beyond = f"the model's limit, {quantity(limit, unit, 3)}, is far beyond"
        torque = quantity(OVERSIZED * needed, unit, 3)
        assumed.append(f"{axis.joint}: peak torque {torque}, {OVERSIZED:g} times what it needs: {beyond}")
        return OVERSIZED * needed, wanted
    left = limit / RESERVE - steady
    if left <= 0.0:
        raise UserError(
            f"{path}: joint {axis.joint!r}: its actuator gives {quantity(limit, unit, 3)} at most, and weight and friction "
            f"take {quantity(steady, unit, 3)} in some pose: correct the actuator's range, or the joint's"
        )
    if limit < PEAK * SMALLEST_MOTOR * axis.ratio:
        raise UserError(
            f"{path}: joint {axis.joint!r}: its actuator gives {quantity(limit, unit, 3)} at most, and behind a gear of "
            f"{axis.ratio:.4g} that is a motor of less than 1 mN·m, the unit of 6076h: correct the actuator's range or gear"
        )
    return limit, min(wanted, left / need.inertia)


def _force_limit(model: mujoco.MjModel, joint: str) -> float:
    """Of the actuators on a joint together, and what the joint bears (`actuatorfrcrange`, of a URDF `effort`), at the joint."""
    number = model.joint(joint).id
    bears = float(np.abs(model.jnt_actfrcrange[number]).min()) if model.jnt_actfrclimited[number] else inf
    return min(bears, _force_of_actuators(model, number))


def _force_of_actuators(model: mujoco.MjModel, number: int) -> float:
    total = 0.0
    on_joint = {int(kind) for kind in ON_JOINT}
    for each in range(model.nu):
        if int(model.actuator_trntype[each]) not in on_joint or int(model.actuator_trnid[each, 0]) != number:
            continue
        gear = abs(float(model.actuator_gear[each, 0]))
        plain = int(model.actuator_biastype[each]) == int(mujoco.mjtBias.mjBIAS_NONE)
        if model.actuator_forcelimited[each]:
            total += gear * float(np.abs(model.actuator_forcerange[each]).min())
        elif model.actuator_ctrllimited[each] and plain:
            gain = abs(float(model.actuator_gainprm[each, 0]))
            total += gear * gain * float(np.abs(model.actuator_ctrlrange[each]).min())
        else:
            return inf
    return total or inf
