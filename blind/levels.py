"""What a machine's nominal model needs of torque on a case's motion: the scale by which effects are drawn to matter."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.machines import DrawnMachine
from drivetwin.blind.motions import PERIOD, Plan, draw_plans

Samples = NDArray[np.float64]

STRIDE = 20
"""Every so many cycles one sample: what matters here is slower."""

STANDSTILL = 0.002
"""Below this share of full speed an axis stands."""


@dataclass(frozen=True)
class Levels:
    """An axis on its demanded motion, each (n,), SI, joint side: position, velocity, acceleration, torque, time [s], moving."""

    position: Samples
    velocity: Samples
    acceleration: Samples
    torque: Samples
    time: Samples
    moving: NDArray[np.bool_]

    @property
    def torque_rms(self) -> float:
        """Of the motor while the axis moves [N·m or N]."""
        return self.rms(self.torque)

    def rms(self, values: Samples) -> float:
        """Of what the axis has (n,) while it moves."""
        return float(np.sqrt(np.mean(values[self.moving] ** 2)))

    def size(self, share: float, regressor: Samples) -> float:
        """The factor at which a torque `regressor` (n,) is a `share` of the axis's torque, both as rms while it moves."""
        return share * self.torque_rms / self.rms(regressor)


def levels_of(machine: DrawnMachine, seed: int) -> dict[str, Levels]:
    """Of every axis, on the training motion of a case."""
    period = STRIDE * PERIOD
    pieces = demanded(machine, draw_plans(machine, seed).training)
    position = np.vstack(pieces)
    velocity = np.vstack([np.gradient(piece, period, axis=0) for piece in pieces])
    acceleration = np.vstack([np.gradient(np.gradient(piece, period, axis=0), period, axis=0) for piece in pieces])
    rigid = rigid_torque(machine.compiled(), position, velocity, acceleration)
    time = np.asarray(np.arange(len(position)) * period, dtype=np.float64)
    levels = {}
    for index, (name, axis) in enumerate(machine.axes.items()):
        speed = velocity[:, index]
        moving = np.abs(speed) > STANDSTILL * axis.max_speed
        torque = rigid[:, index] + np.where(moving, axis.coulomb * np.sign(speed), 0.0) + axis.viscous * speed
        levels[name] = Levels(position[:, index], speed, acceleration[:, index], torque, time, moving)
    return levels


def demanded(machine: DrawnMachine, plans: tuple[Plan, ...]) -> list[Samples]:
    """Positions (n, axes) of each plan, every `STRIDE` cycles; axes that a plan does not name stand."""
    stands = {name: axis.middle for name, axis in machine.axes.items()}
    pieces = []
    for plan in plans:
        length = max(len(path) for path in plan.paths.values())
        columns = []
        for name in machine.axes:
            path = plan.paths.get(name, np.array([stands[name]]))
            columns.append(np.concatenate([path, np.full(length - len(path), path[-1])]))
            stands[name] = float(path[-1])
        pieces.append(np.column_stack(columns)[::STRIDE])
    return pieces


def extra_torque(machine: DrawnMachine, changed: mujoco.MjModel, levels: dict[str, Levels]) -> dict[str, Samples]:
    """What a changed model's rigid bodies need more than the nominal ones on the same motion, (n,) of each axis."""
    motion = [np.column_stack([getattr(level, what) for level in levels.values()]) for what in _MOTION]
    more = rigid_torque(changed, *motion) - rigid_torque(machine.compiled(), *motion)
    return {name: more[:, index] for index, name in enumerate(levels)}


_MOTION = ("position", "velocity", "acceleration")


def rigid_torque(model: mujoco.MjModel, position: Samples, velocity: Samples, acceleration: Samples) -> Samples:
    """Torque (n, axes) of inertia and weight alone, by inverse dynamics; axes in the order of the model's joints."""
    model.dof_damping[:] = 0.0
    model.dof_frictionloss[:] = 0.0
    data = mujoco.MjData(model)
    torque = np.empty_like(position)
    for row in range(len(position)):
        data.qpos[:], data.qvel[:], data.qacc[:] = position[row], velocity[row], acceleration[row]
        mujoco.mj_inverse(model, data)
        torque[row] = data.qfrc_inverse
    return torque

