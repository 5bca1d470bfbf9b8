"""Fig. 4's counterpart: the closed-form dynamics against MuJoCo's inverse dynamics and against Pinocchio's."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio

from drivetwin.controller.machine import Machine, load_machine
from drivetwin.controller.synchronised import synchronised
from drivetwin.motion.inverse_dynamics import Model, read_mjcf
from drivetwin.recording.recording import Samples
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.dynamics import GRAVITY, base_parameters, torque
from wafer_handler.scara.geometry import BELT_OFFSET, BELTS, Geometry, load_geometry, travel_of
from wafer_handler.scara.link_parameters import Body, LinkParameters, from_model

AXES = ("lift", "rotate", "stretch")


@dataclass(frozen=True)
class States:
    """Joint positions, velocities and accelerations, each (n, 3)."""

    joints: Samples
    velocity: Samples
    acceleration: Samples


@dataclass(frozen=True)
class DynamicsDifference:
    """Greatest difference of the closed form from each, over all states: max |a - b| / max |b|, the worst of the three axes."""

    mujoco: float
    pinocchio: float


@dataclass(frozen=True)
class TorqueComparison:
    """Torque of one motion, `time` (n,) [s] and each (n, 3) [N, N·m, N·m]: by the closed form and by the two toolboxes."""

    time: Samples
    closed_form: Samples
    mujoco: Samples
    pinocchio: Samples


def torque_along_a_move() -> TorqueComparison:
    """All axes from rest to rest together through most of their travel, the arm unfolding."""
    arm, period = load_arm(), 0.002
    travels = _travels(arm.machine)
    start = [0.9 * low + 0.1 * high for low, high in travels]
    end = [0.1 * low + 0.9 * high for low, high in travels]
    path = synchronised(start, end, arm.limits).sample(period)
    states = States(path.position, path.velocity, path.acceleration)
    links = from_model(arm.machine.model_path)
    return TorqueComparison(
        time=np.asarray(np.arange(1, len(path.position) + 1) * period, dtype=np.float64),
        closed_form=torque(base_parameters(links, arm.geometry), states.joints, states.velocity, states.acceleration),
        mujoco=mujoco_torque(read_mjcf(arm.machine.model_path), states),
        pinocchio=pinocchio_torque(links, arm.geometry, states),
    )


def _travels(machine: Machine) -> list[tuple[float, float]]:
    travel = travel_of(machine)
    return [travel.lift, travel.rotate, travel.stretch]


def maximum_relative_difference(seed: int, states: int) -> DynamicsDifference:
    """The comparison for the controller's nominal model of the wafer handler on `states` random states."""
    machine, geometry = load_machine("scara"), load_geometry()
    links = from_model(machine.model_path)
    motion = random_states(machine, seed, states)
    ours = torque(base_parameters(links, geometry), motion.joints, motion.velocity, motion.acceleration)
    return DynamicsDifference(
        mujoco=relative_difference(ours, mujoco_torque(read_mjcf(machine.model_path), motion)),
        pinocchio=relative_difference(ours, pinocchio_torque(links, geometry, motion)),
    )


def random_states(machine: Machine, seed: int, count: int) -> States:
    """States spread evenly over the travel, and up to the greatest speed and acceleration both ways, of axes.yaml."""
    random, axes = np.random.default_rng(seed), [machine.axes[name] for name in AXES]
    low, high = np.array(_travels(machine)).T
    speed, acceleration = np.array([(axis.max_speed, axis.max_acceleration) for axis in axes]).T
    return States(
        joints=random.uniform(low, high, (count, 3)),
        velocity=random.uniform(-speed, speed, (count, 3)),
        acceleration=random.uniform(-acceleration, acceleration, (count, 3)),
    )


def relative_difference(ours: Samples, theirs: Samples) -> float:
    """max |ours - theirs| / max |theirs| over the states (n, 3), the worst of the three axes."""
    return float((np.abs(ours - theirs).max(axis=0) / np.abs(theirs).max(axis=0)).max())


def mujoco_torque(model: mujoco.MjModel, states: States) -> Samples:
    """mj_inverse, belt-driven joints added to their axis by J' tau, (n, 3)."""
    return Model(model).torques(AXES, states.joints, states.velocity, states.acceleration)


def pinocchio_torque(links: LinkParameters, geometry: Geometry, states: States) -> Samples:
    """Recursive Newton-Euler of the five-joint chain, belt-driven joints added to their axis by J' tau, (n, 3)."""
    model = pinocchio_model(links, geometry)
    data = model.createData()
    stands, rates = states.joints @ BELTS.T + BELT_OFFSET, states.velocity @ BELTS.T
    rows = zip(stands, rates, states.acceleration @ BELTS.T, strict=True)
    at_joints = np.array([pinocchio.rnea(model, data, *row) for row in rows])
    return np.asarray(at_joints @ BELTS + states.acceleration * links.armature)


def pinocchio_model(links: LinkParameters, geometry: Geometry) -> pinocchio.Model:
    """The chain of the modified DH table with its bodies, without motors; joint by joint, no MuJoCo in between."""
    model = pinocchio.Model()
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    carriage = Body(mass=links.carriage, along=0.0, across=0.0, inertia=0.0)
    kinds = (pinocchio.JointModelPZ(), *(pinocchio.JointModelRZ() for _ in range(4)))
    places = ((0.0, geometry.column), (0.0, 0.0), (0.0, geometry.d3), (geometry.arm, geometry.d4), (geometry.arm, geometry.d5))
    joint = 0
    for kind, (a, d), body in zip(kinds, places, (carriage, *links.bodies), strict=True):
        joint = model.addJoint(joint, kind, pinocchio.SE3(np.eye(3), np.array([a, 0.0, d])), f"joint{joint + 1}")
        centre, inertia = np.array([body.along, body.across, 0.0]), np.diag([body.inertia, body.inertia, body.inertia])
        model.appendBodyToJoint(joint, pinocchio.Inertia(body.mass, centre, inertia), pinocchio.SE3.Identity())
    return model
