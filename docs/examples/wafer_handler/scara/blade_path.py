"""The blade along a straight line: the tool point's line in space, and what the three axes do for it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.controller.joint_path import JointPath, Rows, axis_stretch, slowed
from drivetwin.controller.trajectory import Positions
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import JerkLimited, MotionLimits, jerk_limited
from wafer_handler.scara.arm import Arm
from wafer_handler.scara.geometry import Geometry
from wafer_handler.scara.kinematics import Pose, inverse
from wafer_handler.scara.tool_motion import ToolMotion, joint_path


@dataclass(frozen=True)
class Point:
    """Where the tool point is, in the base frame [m]."""

    x: float
    y: float
    z: float

    def vector(self) -> Positions:
        """(x, y, z) [m]."""
        return np.array([self.x, self.y, self.z])


@dataclass(frozen=True)
class BladeLine:
    """The tool point on a straight line from rest to rest; `way` is the profile along it, from 0 to its length [m].

    The blade points away from the column all along: the belts of the machine have it so. A line towards the column, or away
    from it, is a stretch move: rotate stands.
    """

    geometry: Geometry
    start: Point
    end: Point
    way: JerkLimited

    @property
    def duration(self) -> float:
        """Seconds from rest to rest."""
        return self.way.duration

    def scaled_to(self, duration: float) -> BladeLine:
        """The same line in `duration` seconds; raises UserError where that is shorter."""
        return replace(self, way=self.way.scaled_to(duration))

    def sample(self, period: float) -> JointPath:
        """Lift, rotate, stretch at period, 2 period, ... (n, 3); the last is the end."""
        way = self.way.sample(period)
        span = self.end.vector() - self.start.vector()
        direction = span / self.way.end if self.way.end else span
        tool = ToolMotion(
            position=self.start.vector() + np.outer(way.position, direction),
            velocity=np.outer(way.velocity, direction),
            acceleration=np.outer(way.acceleration, direction),
        )
        return joint_path(self.geometry, tool, period)


def blade_line(arm: Arm, start: Point, end: Point, along: MotionLimits, period: float) -> BladeLine:
    """The straight line from `start` to `end` within the axes' limits and `along`: speed, acceleration, jerk of the tool point.

    Where an axis would be too fast, the whole line gets slower. Raises UserError where the line leaves the workspace: where on
    it, how far, and why.
    """
    _refuse_outside(arm, start, end)
    length = float(np.linalg.norm(end.vector() - start.vector()))
    line = BladeLine(arm.geometry, start, end, jerk_limited(0.0, length, along))
    return slowed(line, period, lambda path: axis_stretch(path, arm.limits))


def distance_from_line(start: Point, end: Point, positions: Rows) -> Positions:
    """How far the tool point at `positions` (n, 3) [m] is from the line through `start` and `end` [m] (n,).

    Raises UserError where the two points are one.
    """
    span = end.vector() - start.vector()
    length = np.linalg.norm(span)
    if length == 0.0:
        raise UserError(f"two points make a line; start and end are both at ({start.x:g}, {start.y:g}, {start.z:g}) m")
    offset = positions - start.vector()
    return np.asarray(np.linalg.norm(np.cross(offset, span / length), axis=1))


def _refuse_outside(arm: Arm, start: Point, end: Point) -> None:
    """Four points decide: both ends, the nearest to the column, and where the line crosses the y axis.

    The distance from the column is convex along a line, angle and height are monotonous, and behind the column the angle jumps.
    """
    span = end.vector() - start.vector()
    level = span[0] ** 2 + span[1] ** 2
    nearest = -(start.x * span[0] + start.y * span[1]) / level if level else 0.0
    crossing = -start.x / span[0] if span[0] else 0.0
    for share in np.clip(sorted((0.0, nearest, crossing, 1.0)), 0.0, 1.0):
        x, y, z = start.vector() + share * span
        try:
            inverse(arm.geometry, Pose(x, y, z, np.arctan2(y, x)), arm.travel)
        except UserError as reason:
            way = share * np.linalg.norm(span)
            raise UserError(f"the blade's line leaves the workspace {way:.4g} m after its start: {reason}") from None
