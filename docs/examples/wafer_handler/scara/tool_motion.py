"""The tool point's acceleration for a motion of the joints, and the joints' motion for a motion of the tool point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.controller.joint_path import JointPath, Rows
from wafer_handler.scara.geometry import Geometry
from wafer_handler.scara.kinematics import Pose, inverse, jacobian


@dataclass(frozen=True)
class ToolMotion:
    """The tool point, all (n, 3) in the base frame: position [m], velocity [m/s], acceleration [m/s²]."""

    position: Rows
    velocity: Rows
    acceleration: Rows


def tool_acceleration(geometry: Geometry, path: JointPath) -> Rows:
    """Acceleration of the tool point [m/s²] (n, 3): J q'' + J' q'."""
    by_joints = np.einsum("nij,nj->ni", jacobian(geometry, path.position), path.acceleration)
    return np.asarray(by_joints + _velocity_terms(geometry, path.position, path.velocity))


def joint_path(geometry: Geometry, tool: ToolMotion, period: float) -> JointPath:
    """The joints' motion for a motion of the tool whose blade points away from the column; exact derivatives.

    q' = J^-1 v, q'' = J^-1 (a - J' q'). Raises UserError for a position that the arm does not reach.
    """
    x, y, z = tool.position.T
    joints = inverse(geometry, Pose(x, y, z, np.arctan2(y, x)))
    to_tool = jacobian(geometry, joints)
    velocity = _solve(to_tool, tool.velocity)
    acceleration = _solve(to_tool, tool.acceleration - _velocity_terms(geometry, joints, velocity))
    return JointPath(period, joints, velocity, acceleration)


def _velocity_terms(geometry: Geometry, joints: Rows, velocity: Rows) -> Rows:
    """J' q' (n, 3): towards the column r theta2'² and 2 L3 sin theta3 theta3'², across the blade 2 r' theta2' (Coriolis)."""
    _, rotate, stretch = joints.T
    _, turning, bending = velocity.T
    folding = 2.0 * geometry.arm * np.sin(stretch)
    outward = -(folding + geometry.blade) * turning**2 - folding * bending**2
    across = 4.0 * geometry.arm * np.cos(stretch) * bending * turning
    sine, cosine = np.sin(rotate), np.cos(rotate)
    return np.column_stack([-sine * outward - cosine * across, cosine * outward - sine * across, np.zeros_like(sine)])


def _solve(matrices: Rows, vectors: Rows) -> Rows:
    """x (n, 3) of matrices (n, 3, 3) times x = vectors (n, 3)."""
    return np.asarray(np.linalg.solve(matrices, vectors[:, :, None])[:, :, 0])
