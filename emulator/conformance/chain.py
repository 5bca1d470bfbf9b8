"""Two hinges in a chain at random states: the torque that effects on rigid bodies cause on both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.assembly import DrivenJoint
from drivetwin.emulator.conformance import bench
from drivetwin.emulator.conformance.bench import GEAR, MOTOR, ROTOR, SAMPLE, WHOLE
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects import Effect, Ground, PlacedEffect
from drivetwin.emulator.mechanism import Mechanism
from drivetwin.motion.inverse_dynamics import Model

Array = NDArray[np.float64]

AXES = ("before", "axis")
_STATES = np.random.default_rng(7).uniform(-2.0, 2.0, (3, 200, 2))
"""Positions, velocities, accelerations of both [rad, rad/s, rad/s²]."""
_MODEL = """<mujoco model="chain"><compiler angle="radian"/><option gravity="0 0 -10" timestep="0.000125"/><worldbody>
<body><joint name="before" type="hinge" axis="0 1 0"/><inertial pos="0 0 -0.2" mass="2" diaginertia="0.1 0.1 0.1"/>
<body pos="0 0 -0.4"><joint name="axis" type="hinge" axis="0 1 0"/><inertial pos="0 0 -0.3" mass="1" diaginertia="0.1 0.1 0.1"/>
</body></body></worldbody>
<actuator><motor name="before" joint="before"/><motor name="axis" joint="axis"/></actuator></mujoco>"""


def costs(effect: Effect) -> Array:
    """Torque (n, 2) of both axes, which an effect on the second costs, by inverse dynamics."""
    spec = mujoco.MjSpec.from_string(_MODEL)
    effect.add_to(spec, spec.joint("axis"), AxisDynamics())
    return np.asarray(_needed(spec) - _needed(mujoco.MjSpec.from_string(_MODEL)))


def _needed(spec: mujoco.MjSpec) -> Array:
    return np.asarray(Model(spec.compile()).torques(AXES, *_STATES))


def ground(seed: int) -> Ground:
    """What effects are drawn for: the second hinge at these states."""
    torque = _needed(mujoco.MjSpec.from_string(_MODEL))[:, 1]
    position, velocity, acceleration = _STATES[:, :, 1]
    time = np.asarray(np.arange(len(torque)) * SAMPLE, dtype=np.float64)
    motion = Motion(position, velocity, acceleration, torque, time, torque, np.full_like(torque, WHOLE), MOTOR)
    moving = np.ones(len(torque), dtype=np.bool_)
    alone = bench.ground("hinge", seed)
    return replace(alone, motion=motion, moving=moving, of_bodies=lambda effect: np.asarray(costs(effect)[:, 1]))


def plant_costs(effect: Effect) -> Array:
    """The same by plants with it and without: what torque they ask for those accelerations, from how both answer to torques."""
    return np.asarray(_asked((PlacedEffect("axis", effect, {}),)) - _asked(()))


def _asked(effects: Sequence[PlacedEffect]) -> Array:
    """Torque (n, 2) for the accelerations: at each state they are affine in the torques."""
    drives = {name: DrivenJoint(name, name, GEAR, ROTOR, 0.0, 0.0) for name in AXES}
    plant = Mechanism(mujoco.MjSpec.from_string(_MODEL), drives, tuple(effects))
    asked = []
    for position, velocity, acceleration in zip(*_STATES, strict=True):
        free, first, second = (_answer(plant, position, velocity, torque) for torque in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
        asked.append(np.linalg.solve(np.column_stack([first - free, second - free]), acceleration - free))
    return np.asarray(np.array(asked) - MOTOR * _STATES[2])


def _answer(plant: Mechanism, position: Array, velocity: Array, torque: tuple[float, float]) -> Array:
    """Accelerations (2,) of the joints under torques of the motors at the joint."""
    plant.data.qpos[:], plant.data.qvel[:] = position, velocity
    plant.data.ctrl[:] = np.array(torque) / GEAR
    mujoco.mj_forward(plant.model, plant.data)
    return np.asarray(plant.data.qacc.copy())
