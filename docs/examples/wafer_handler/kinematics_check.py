"""The arm's kinematics held against MuJoCo's, and its inverse against itself, over the workspace."""

from __future__ import annotations

import mujoco
import numpy as np

from drivetwin.controller.machine import load_machine
from drivetwin.recording.recording import Samples
from wafer_handler.bench import MACHINE
from wafer_handler.scara.geometry import BELTS, JOINTS, load_geometry, travel_of
from wafer_handler.scara.kinematics import forward, inverse


def maximum_error(seed: int, poses: int) -> float:
    """Greatest distance [m] of the tool point at random joints from MuJoCo's, and after inverse and forward from itself."""
    geometry, travel = load_geometry(), travel_of(load_machine("scara"))
    low, high = np.array([travel.lift, travel.rotate, travel.stretch]).T
    joints = np.random.default_rng(seed).uniform(low, high, (poses, 3))
    pose = forward(geometry, joints)
    ours = np.column_stack([pose.x, pose.y, pose.z])
    again = forward(geometry, inverse(geometry, pose))
    back = np.column_stack([again.x, again.y, again.z])
    theirs = _tool_points(joints)
    return float(max(np.linalg.norm(ours - theirs, axis=1).max(), np.linalg.norm(back - theirs, axis=1).max()))


def _tool_points(joints: Samples) -> Samples:
    """MuJoCo's tool site (n, 3) [m] of the plant's model, belts exact."""
    model = mujoco.MjModel.from_xml_path(str(MACHINE.model_path))
    data = mujoco.MjData(model)
    places = [model.joint(name).qposadr[0] for name in JOINTS]
    home = model.qpos0[places[:3]]
    points = np.empty((len(joints), 3))
    for row, at in enumerate(joints):
        data.qpos[places] = model.qpos0[places] + BELTS @ (at - home)
        mujoco.mj_kinematics(model, data)
        points[row] = data.site("tool").xpos
    return points
