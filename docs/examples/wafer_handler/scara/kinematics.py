"""Where the blade is for the joints, and the joints for where it should be: docs/wafer-handler.md, "Kinematics".

Joints are (lift [m], rotate = theta2 [rad], stretch = theta3 [rad]). The belts keep the blade pointing along theta2 + 90 deg:

    reach = 2 L3 sin theta3 + L5,    x = -reach sin theta2,    y = reach cos theta2,    z = d1 + d3 + d4 + d5
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Samples
from wafer_handler.scara.geometry import BELT_OFFSET, BELTS, FULL_TRAVEL, Geometry, Travel

ROUNDING = 1e-9
"""Metres or radians by which a target may lie past the end of a travel: rounding, not a wish."""

ACROSS_TOLERANCE = 1e-6
"""Metres that a pose may lie beside the line on which the blade moves; the drives' position unit is a hundredth of it."""


@dataclass(frozen=True)
class Pose:
    """The tool point [m] and the direction of the blade (its x axis against the base's) [rad]; each of the same shape (...)."""

    x: Samples
    y: Samples
    z: Samples
    yaw: Samples


@dataclass(frozen=True)
class DhRow:
    """One row of a modified DH table: alpha_(i-1) [rad], a_(i-1) [m], d_i [m], theta_i [rad]; d and theta of shape (...)."""

    alpha: float
    a: float
    d: Samples
    theta: Samples


def transform(link: DhRow) -> Samples:
    """Frame i seen from frame i-1, (..., 4, 4): Craig, Introduction to Robotics, 3rd ed., eq. 3.6."""
    d, theta = np.broadcast_arrays(link.d, link.theta)
    ca, sa, ct, st = np.cos(link.alpha), np.sin(link.alpha), np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(ct), np.ones_like(ct)
    rows = [
        [ct, -st, zero, link.a * one],
        [st * ca, ct * ca, -sa * one, -sa * d],
        [st * sa, ct * sa, ca * one, ca * d],
        [zero, zero, zero, one],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def chain(links: tuple[DhRow, ...]) -> Samples:
    """The last frame seen from the base, (..., 4, 4)."""
    frame: Samples = np.eye(4)
    for link in links:
        frame = frame @ transform(link)
    return frame


def links(geometry: Geometry, joints: Samples) -> tuple[DhRow, ...]:
    """The modified DH table for `joints` (..., 3): joints 1 to 5 and the tool."""
    lift, theta2, theta3, theta4, theta5 = np.moveaxis(joints @ BELTS.T + BELT_OFFSET, -1, 0)
    none = np.zeros_like(lift)
    return (
        DhRow(0.0, 0.0, geometry.column + lift, none),
        DhRow(0.0, 0.0, none, theta2),
        DhRow(0.0, 0.0, none + geometry.d3, theta3),
        DhRow(0.0, geometry.arm, none + geometry.d4, theta4),
        DhRow(0.0, geometry.arm, none + geometry.d5, theta5),
        DhRow(0.0, geometry.blade, none, none),
    )


def forward(geometry: Geometry, joints: Samples) -> Pose:
    """The pose for `joints` (..., 3), in closed form. Yaw is not wrapped: it follows theta2 past 180 deg."""
    lift, rotate, stretch = np.moveaxis(joints, -1, 0)
    reach = 2.0 * geometry.arm * np.sin(stretch) + geometry.blade
    return Pose(-reach * np.sin(rotate), reach * np.cos(rotate), geometry.height + lift, rotate + pi / 2.0)


def jacobian(geometry: Geometry, joints: Samples) -> Samples:
    """d (x, y, z) / d (lift, rotate, stretch) for `joints` (..., 3), (..., 3, 3).

    Singular where the reach is 0 or theta3 is 90 deg.
    """
    _, rotate, stretch = np.moveaxis(joints, -1, 0)
    reach = 2.0 * geometry.arm * np.sin(stretch) + geometry.blade
    lever = 2.0 * geometry.arm * np.cos(stretch)
    sine, cosine = np.sin(rotate), np.cos(rotate)
    zero, one = np.zeros_like(rotate), np.ones_like(rotate)
    rows = [[zero, -reach * cosine, -lever * sine], [zero, -reach * sine, lever * cosine], [one, zero, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def inverse(geometry: Geometry, pose: Pose, travel: Travel = FULL_TRAVEL) -> Samples:
    """The joints (..., 3) of `pose`; theta2 in (-180 deg, 180 deg].

    theta2 = atan2(-n_x, n_y) for the blade's direction n, theta3 = asin((-s2 x + c2 y - L5) / (2 L3)), d1 = z - d3 - d4 - d5.
    An error e of the reach becomes e / (2 L3 cos theta3) in theta3, and sqrt(e / L3) at 90 deg: the stretched arm is singular.

    Raises UserError for the first pose that lies outside `travel`, or beside the line on which its yaw lets the blade move.
    """
    direction_x, direction_y = np.cos(pose.yaw), np.sin(pose.yaw)
    rotate = np.arctan2(-direction_x, direction_y)
    reach = pose.x * direction_x + pose.y * direction_y
    across = pose.x * direction_y - pose.y * direction_x
    rows = np.broadcast_arrays(pose.x, pose.y, pose.z, pose.yaw, rotate, reach, across)
    for x, y, z, yaw, turn, length, beside in np.nditer(rows, flags=["zerosize_ok"]):
        reason = _beside_its_line(x, y, yaw, beside) or _outside(geometry, travel, float(turn), float(length), float(z))
        if reason:
            raise UserError(f"the pose ({x:.6g}, {y:.6g}, {z:.6g}) m, yaw {yaw:.6g} rad cannot be reached: {reason}")
    return _joints(geometry, rotate, reach, np.asarray(pose.z))


def _joints(geometry: Geometry, rotate: Samples, reach: Samples, z: Samples) -> Samples:
    stretch = np.arcsin(np.clip((reach - geometry.blade) / (2.0 * geometry.arm), -1.0, 1.0))
    return np.stack(np.broadcast_arrays(z - geometry.height, rotate, stretch), axis=-1)


def _beside_its_line(x: Samples, y: Samples, yaw: Samples, beside: Samples) -> str | None:
    """Why a pose contradicts the belts: the line of its blade has to pass through the column's axis."""
    if abs(beside) <= ACROSS_TOLERANCE:
        return None
    off = np.angle(np.exp(1j * (yaw - np.arctan2(y, x))))
    return (
        f"its blade's line passes the column's axis at {abs(beside):.4g} m, and the belts keep it on the axis; "
        f"a blade pointing outwards there has yaw {np.arctan2(y, x):.6g} rad, this one is turned {off:.4g} rad from it"
    )


def _outside(geometry: Geometry, travel: Travel, rotate: float, reach: float, z: float) -> str | None:
    """Why a target is out of `travel`, None where it is inside. `reach` is signed along the blade."""
    nearest, farthest = (2.0 * geometry.arm * float(np.sin(end)) + geometry.blade for end in travel.stretch)
    if reach > farthest + ROUNDING:
        return f"too far: it lies {reach:.6g} m from the column, the blade reaches {farthest:.6g} m"
    if reach < nearest - ROUNDING:
        return f"too near: it lies {reach:.6g} m from the column along the blade, the folded arm reaches {nearest:.6g} m"
    lift = z - geometry.height
    for axis, value, unit, (low, high) in (("lift", lift, "m", travel.lift), ("rotate", rotate, "rad", travel.rotate)):
        if not low - ROUNDING <= value <= high + ROUNDING:
            return f"{axis} would stand at {value:.6g} {unit}, its travel is {low:.6g} .. {high:.6g} {unit}"
    return None
