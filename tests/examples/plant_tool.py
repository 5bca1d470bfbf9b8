"""Where the plant's tool really is, goes and is accelerated to: MuJoCo's kinematics of the plant's own model, belts and all."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin import emulator
from drivetwin.controller.joint_path import JointPath

BELTS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 0.0, 1.0]])
"""Joints lift, rotate, stretch, elbow, wrist of a change of lift, rotate, stretch."""


@dataclass(frozen=True)
class Tool:
    """The `tool` site, (n, 3) in the base frame: position [m], velocity [m/s], acceleration [m/s²]; yaw of the blade (n,)."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    yaw: NDArray[np.float64]


def plant_tool(path: JointPath) -> Tool:
    """The plant's tool on a joint path, by MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(Path(emulator.__file__).parent / "machines" / "scara" / "scara.xml"))
    model.opt.gravity[:] = 0.0
    data, site = mujoco.MjData(model), model.site("tool").id
    offset = model.qpos0 - BELTS @ model.qpos0[:3]
    position, velocity, acceleration, yaw = [], [], [], []
    motion = np.zeros(6)
    for q, v, a in zip(path.position, path.velocity, path.acceleration, strict=True):
        data.qpos[:], data.qvel[:] = BELTS @ q + offset, BELTS @ v
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        data.qacc[:] = BELTS @ a
        mujoco.mj_rnePostConstraint(model, data)
        position.append(data.site_xpos[site].copy())
        along_blade = data.site_xmat[site].reshape(3, 3)[:, 0]
        yaw.append(np.arctan2(along_blade[1], along_blade[0]))
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_SITE, site, motion, 0)
        velocity.append(motion[3:].copy())
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_SITE, site, motion, 0)
        acceleration.append(motion[3:].copy())
    return Tool(np.array(position), np.array(velocity), np.array(acceleration), np.array(yaw))
