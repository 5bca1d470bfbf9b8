"""Within what an exciting motion stays: travel, speed, acceleration and jerk of every axis that may move."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco

from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.motion.jerk_limited import MotionLimits
from drivetwin.motion.limits_file import PlannedEntry, read_planned

INNER = 0.9
"""Share of the travel that is used: what overshoots stays inside."""


@dataclass(frozen=True)
class AxisLimits:
    """Joint side: travel [m or rad], and the most speed, acceleration and jerk [per s, s², s³] within it."""

    travel: tuple[float, float]
    most: MotionLimits

    @property
    def room(self) -> float:
        """Length of the travel."""
        return self.travel[1] - self.travel[0]

    def at(self, share: float) -> float:
        """The position at a share of the travel, 0 its low end."""
        return self.travel[0] + share * self.room

    def slower(self, share: float) -> MotionLimits:
        """The limits with less speed."""
        return replace(self.most, speed=share * self.most.speed)


def read_limits(path: Path, model: Path) -> dict[str, AxisLimits]:
    """Limits by axis from a file; an axis without travel has the range of the model's joint of its name, whichever is less.

    Raises UserError naming the file and what is missing or wrong.
    """
    told = read_planned(path)
    ranges = _joint_ranges(model)
    return {name: _inside(path, name, entry, ranges.get(name)) for name, entry in told.items()}


def _inside(path: Path, axis: str, entry: PlannedEntry, of_joint: tuple[float, float] | None) -> AxisLimits:
    spans = [span for span in (entry.travel, of_joint) if span is not None]
    if not spans:
        raise UserError(f"{path}: axis {axis} has no travel, and the model no range of joint {axis!r}: add travel: [low, high]")
    low, high = max(span[0] for span in spans), min(span[1] for span in spans)
    if low >= high:
        raise UserError(f"{path}: axis {axis} has travel {entry.travel} and its joint {of_joint}: nowhere to move")
    edge = 0.5 * (1.0 - INNER) * (high - low)
    return AxisLimits((low + edge, high - edge), MotionLimits(entry.speed, entry.acceleration, entry.jerk))


def _joint_ranges(path: Path) -> dict[str, tuple[float, float]]:
    """Of the joints that have one, by name; a slide or a hinge."""
    model = read_mjcf(path)
    one_way = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return {
        model.joint(index).name: (float(model.jnt_range[index, 0]), float(model.jnt_range[index, 1]))
        for index in range(model.njnt)
        if model.jnt_limited[index] and int(model.jnt_type[index]) in one_way
    }
