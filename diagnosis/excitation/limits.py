"""Within what an exciting motion stays: travel, speed, acceleration and jerk of every axis that may move."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import yaml
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_yaml
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.motion.jerk_limited import MotionLimits

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


class _AxisEntry(BaseModel):
    """One axis of a limits file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    travel: tuple[FiniteFloat, FiniteFloat] | None = None
    speed: FiniteFloat = Field(gt=0.0)
    acceleration: FiniteFloat = Field(gt=0.0)
    jerk: FiniteFloat = Field(gt=0.0)


class _LimitsFile(BaseModel):
    """`axes: {name: {travel: [low, high], speed: ..., acceleration: ..., jerk: ...}}`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    axes: dict[str, _AxisEntry]


def read_limits(path: Path, model: Path) -> dict[str, AxisLimits]:
    """Limits by axis from a file; an axis without travel has the range of the model's joint of its name, whichever is less.

    Raises UserError naming the file and what is missing or wrong.
    """
    try:
        told = _LimitsFile.model_validate(parse_yaml(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise UserError(f"no limits file {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}") from None
    except yaml.YAMLError as error:
        raise UserError(f"{path} is not YAML: {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        needs = "an axis needs speed, acceleration and jerk, and may have travel"
        raise UserError(f"{path}: {where}: {first['msg']}; {needs}") from None
    ranges = _joint_ranges(model)
    return {name: _inside(path, name, entry, ranges.get(name)) for name, entry in told.axes.items()}


def _inside(path: Path, axis: str, entry: _AxisEntry, of_joint: tuple[float, float] | None) -> AxisLimits:
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
