"""Rigid bodies in closed form: the equations of motion of the drawn families, with numbers read from their models.

Slides, hinges, and a pair of parallel hinges at the end of the chain: a two-link arm (Spong, Hutchinson, Vidyasagar, Robot
Modeling and Control, 2006, sec. 7.4). Nothing of MuJoCo runs while the machine moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.compiled import compiled

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class RigidBodies:
    """M(q) a + c(q, v) + g(q) = torque, joint side, SI.

    `inertia` (n, n) is M without what changes with the last joint: beta = `swing` . (cos q_n, sin q_n) is added to M_(n-1,n),
    twice to M_(n-1,n-1). `weight` (n, 3): g of each joint over (sin q, cos q, 1), of the outer link in the pair over the sum
    of both angles; `outer` (2,): the same for (sin, cos) of the sum, felt by both.
    """

    inertia: Matrix
    swing: Matrix
    weight: Matrix
    outer: Matrix


def rigid_bodies(model: mujoco.MjModel) -> RigidBodies:
    """Read the numbers off a model by weighing it in a few poses; rotors (armature) are in `inertia`."""
    count = model.nv
    rest = np.zeros(count)
    if count == 1:
        return RigidBodies(_mass(model, rest), np.zeros(2), _weights_alone(model), np.zeros(2))
    turned = np.zeros(count)
    turned[-1] = 0.5 * np.pi
    opposite = np.zeros(count)
    opposite[-1] = np.pi
    along, across, back = (_mass(model, pose)[-2, -1] for pose in (rest, turned, opposite))
    steady = 0.5 * (along + back)
    swing = np.array([along - steady, across - steady])
    inertia = _mass(model, rest)
    inertia[-2, -1] = inertia[-1, -2] = steady
    inertia[-2, -2] -= 2.0 * swing[0]
    outer = np.array([_gravity(model, turned)[-1], _gravity(model, rest)[-1]])
    weight = _weights_alone(model)
    weight[-1] = 0.0
    weight[-2, :2] -= outer
    return RigidBodies(inertia, swing, weight, outer)


def _weights_alone(model: mujoco.MjModel) -> Matrix:
    """(n, 3): what gravity asks of each joint over (sin q, cos q, 1), the others at 0."""
    weights = np.zeros((model.nv, 3))
    for joint in range(model.nv):
        if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
            weights[joint, 2] = _gravity(model, np.zeros(model.nv))[joint]
            continue
        pose = np.zeros(model.nv)
        weights[joint, 1] = _gravity(model, pose)[joint]
        pose[joint] = 0.5 * np.pi
        weights[joint, 0] = _gravity(model, pose)[joint]
    return weights


def _mass(model: mujoco.MjModel, pose: Matrix) -> Matrix:
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return mass


def _gravity(model: mujoco.MjModel, pose: Matrix) -> Matrix:
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_forward(model, data)
    return np.array(data.qfrc_bias)


@compiled
def accelerations(inertia, swing, weight, outer, position, velocity, torque, acceleration) -> None:  # type: ignore[no-untyped-def]
    """Fill `acceleration` (n,) from positions, velocities and torques (n,); arrays as in RigidBodies."""
    count = torque.shape[0]
    for joint in range(count):
        q = position[joint]
        pull = weight[joint, 0] * sin(q) + weight[joint, 1] * cos(q) + weight[joint, 2]
        acceleration[joint] = (torque[joint] - pull) / inertia[joint, joint]
    if count < 2:
        return
    i, j = count - 2, count - 1
    q = position[j]
    beta = swing[0] * cos(q) + swing[1] * sin(q)
    slope = swing[1] * cos(q) - swing[0] * sin(q)
    both = position[i] + q
    pull = outer[0] * sin(both) + outer[1] * cos(both)
    own = weight[i, 0] * sin(position[i]) + weight[i, 1] * cos(position[i]) + weight[i, 2]
    first = torque[i] - own - pull - slope * (2.0 * velocity[i] + velocity[j]) * velocity[j]
    second = torque[j] - pull + slope * velocity[i] * velocity[i]
    m11, m12, m22 = inertia[i, i] + 2.0 * beta, inertia[i, j] + beta, inertia[j, j]
    determinant = m11 * m22 - m12 * m12
    acceleration[i] = (m22 * first - m12 * second) / determinant
    acceleration[j] = (m11 * second - m12 * first) / determinant
