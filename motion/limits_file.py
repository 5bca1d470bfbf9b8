"""The limits file: travel, speed, torque, acceleration and jerk of axes, as a person writes it; the only place that reads it.

`axes: {name: {travel: [low, high], speed: ..., torque: ..., acceleration: ..., jerk: ...}}`, joint side, SI. Who reads it says
what an axis needs, so one file can serve a controller, a bench and an exciting motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Generic, TypeVar

from pydantic import AfterValidator, Field, FiniteFloat

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.typed_yaml import Strict, read_yaml, typed


def _lowest_first(travel: tuple[float, float]) -> tuple[float, float]:
    if not travel[0] < travel[1]:
        raise ValueError(f"expected [lowest, highest], not {list(travel)}")
    return travel


Positive = Annotated[FiniteFloat, Field(gt=0.0)]
Travel = Annotated[tuple[FiniteFloat, FiniteFloat], AfterValidator(_lowest_first)]


class AxisEntry(Strict):
    """One axis: travel [m or rad], the most speed, acceleration and jerk [per s, s², s³] and torque [N or N·m]."""

    travel: Travel | None = None
    speed: Positive | None = None
    torque: Positive | None = None
    acceleration: Positive | None = None
    jerk: Positive | None = None


class BoundedEntry(AxisEntry):
    """What a machine that can hurt somebody needs."""

    travel: Travel
    speed: Positive
    torque: Positive


class PlannedEntry(AxisEntry):
    """What a motion that is planned needs."""

    speed: Positive
    acceleration: Positive
    jerk: Positive


Entry = TypeVar("Entry", bound=AxisEntry)


class _File(Strict, Generic[Entry]):
    axes: dict[str, Entry]


@dataclass(frozen=True)
class Bounds:
    """Joint side: travel [m or rad], greatest speed [m/s or rad/s] and torque [N or N·m]."""

    travel: tuple[float, float]
    speed: float
    torque: float


def read_bounds(path: Path, axes: Sequence[str]) -> Mapping[str, Bounds]:
    """The bounds of every axis of a machine, in its order. Raises UserError naming the file and what is missing or wrong."""
    given = typed(_File[BoundedEntry], read_yaml(path), path).axes
    if set(given) != set(axes):
        raise UserError(f"{path}: axes: limits of {', '.join(given) or 'none'}, and the machine has {', '.join(axes)}")
    return {axis: Bounds(given[axis].travel, given[axis].speed, given[axis].torque) for axis in axes}


def read_planned(path: Path) -> Mapping[str, PlannedEntry]:
    """The axes that a motion may be planned for. Raises UserError as `read_bounds`."""
    return typed(_File[PlannedEntry], read_yaml(path), path).axes
