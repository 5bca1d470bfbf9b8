"""A recording in memory: the samples of each axis and its description (contract recording/2)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, PlainSerializer, PlainValidator, field_validator

from drivetwin.foundation.json_value import JsonValue

SCHEMA = "recording/2"
FIRST_SCHEMA = "recording/1"
"""The same with `torque` required and fewer columns and keys; it is read, and no longer written."""

Samples = NDArray[np.float64]

TORQUE = "torque"
ONE_OF = ("position", "velocity")
WITHOUT_TORQUE = ("position", "position_demand")
"""What is required of an axis whose torque was not recorded."""
OPTIONAL = (
    "position_demand",
    "velocity_demand",
    "velocity_offset",
    "torque_offset",
    "joint_position",
    "joint_velocity",
    "joint_torque",
    "temperature",
)
COLUMNS = (TORQUE, *ONE_OF, *OPTIONAL)

NotNegative = Annotated[FiniteFloat, Field(ge=0)]
Positive = Annotated[FiniteFloat, Field(gt=0)]


def needed(names: Iterable[str]) -> list[str]:
    """Columns of an axis that need a finite number in every row: the measured ones, and without torque the demand."""
    present = set(names)
    return [name for name in (TORQUE, *ONE_OF) if name in present] + ["position_demand"] * (
        TORQUE not in present and "position_demand" in present
    )


class Interpolation(StrEnum):
    """How a drive goes on from set-point to set-point."""

    LINEAR = "linear"
    CUBIC_SPLINE = "cubic_spline"


class DriveLaw(StrEnum):
    """The control law of an axis."""

    CASCADE = "cascade"
    """P position loop over a P or PI velocity loop, the gains as in `DriveLoops`."""
    PID = "pid"
    """One PID loop from position to torque."""
    PD_POSITION_SERVO = "pd_position_servo"
    """Torque in proportion to the position error, less damping: the position actuator of a simulation."""
    TORQUE = "torque"
    """None: the demand is a torque."""
    UNKNOWN = "unknown"


def _law_by_gains(told: dict[str, Any]) -> DriveLaw:
    gains = (told.get("position_gain"), told.get("velocity_gain"))
    return DriveLaw.CASCADE if any(gain is not None for gain in gains) else DriveLaw.UNKNOWN


class _Kept(BaseModel):
    """A part of recording.json whose keys outside the contract are kept, in the values that JSON has."""

    model_config = ConfigDict(extra="allow", populate_by_name=True)

    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)


class DriveLoops(_Kept):
    """The drive's control loops, joint side; None if unknown.

    `position_gain` [1/s], `velocity_gain` [N·m·s/rad or N·s/m], `integral_time` [s] (None: a P velocity loop),
    `velocity_feedforward` [1] of the demand's derivative, which is `velocity_feedforward_lead` [s] ahead of the backward
    difference over a servo period (None: not told), `torque_limit` [N·m or N], `servo_period` [s],
    `velocity_filter_hz` [Hz], `current_loop_time_constant` [s]. `law`: the control law of the gains; a cascade if gains are
    given without a law. `interpolation`: how the demand goes on from cycle to cycle of the bus. Every number is finite and not
    negative.
    """

    position_gain: NotNegative | None = None
    velocity_gain: NotNegative | None = None
    integral_time: NotNegative | None = None
    velocity_feedforward: NotNegative = 1.0
    velocity_feedforward_lead: NotNegative | None = None
    torque_limit: NotNegative | None = None
    servo_period: NotNegative | None = None
    velocity_filter_hz: NotNegative | None = None
    current_loop_time_constant: NotNegative | None = None
    interpolation: Interpolation | None = None
    law: DriveLaw = Field(default_factory=_law_by_gains)


class AxisInfo(_Kept):
    """One entry of `axes` in recording.json, joint side; None if unknown.

    `joint` and `actuator` are names in the MuJoCo model. `rated_torque` and `torque_resolution` [N·m or N],
    `position_resolution` [rad or m], `gear_ratio` [motor turns per joint turn, or rad/m]: finite, the resolutions may be 0.
    `torque_bandwidth_hz` [Hz]: the torque column's -3 dB frequency. `torque_delay` [s]: delay of the torque
    column. `position_relative`: the zero of the position belongs to the recording, not to the model.
    """

    joint: str
    actuator: str | None = None
    rated_torque: Positive | None = None
    torque_resolution: NotNegative | None = None
    torque_bandwidth_hz: Positive | None = None
    torque_delay: FiniteFloat | None = None
    position_resolution: NotNegative | None = None
    position_relative: bool = False
    gear_ratio: Positive | None = None
    drive: DriveLoops | None = None


def _start_time(value: object) -> float | datetime | None:
    """Seconds, an ISO date with its time, or None; raises ValueError otherwise."""
    if value is None or isinstance(value, datetime):
        return value
    with suppress(ValueError, OverflowError):
        if isinstance(value, (int, float)) and not isinstance(value, bool) and 0.0 <= float(value) < math.inf:
            return float(value)
        if isinstance(value, str) and ":" in value:  # a day without its time does not say when
            return datetime.fromisoformat(value)
    raise ValueError("expected seconds since the machine was switched on, an ISO date and time, or null")


StartTime = Annotated[
    float | datetime | None,
    PlainValidator(_start_time),
    PlainSerializer(lambda value: value.isoformat() if isinstance(value, datetime) else value),
]


class RecordingInfo(_Kept):
    """recording.json; keys outside the contract are kept.

    `sample_period` [s]. `start_time`: the instant at which the `time` column is 0, as seconds since the machine was switched on
    or as date and time; None: unknown, the times of different recordings are unrelated. No two axes share a joint.
    """

    schema_: str = Field(default=SCHEMA, alias="schema")
    machine: str
    sample_period: Positive
    start_time: StartTime = None
    derived: list[str] = []
    axes: dict[str, AxisInfo] = Field(min_length=1)

    @field_validator("axes")
    @classmethod
    def _a_joint_each(cls, axes: dict[str, AxisInfo]) -> dict[str, AxisInfo]:
        first: dict[str, str] = {}
        for axis, info in axes.items():
            if first.setdefault(info.joint, axis) != axis:
                raise ValueError(f"axes {first[info.joint]} and {axis} are both on joint {info.joint!r}; an axis has its own")
        return axes


@dataclass(frozen=True)
class Recording:
    """Samples of one recording.

    `time` is (n,) [s], rising in equal steps; `columns[axis][name]` is (n,) in SI units on the joint side.
    `source` is the directory from which it was read, None if it has not been written yet.
    """

    name: str
    info: RecordingInfo
    time: Samples
    columns: dict[str, dict[str, Samples]]
    source: Path | None = None
    files: tuple[Path, ...] = field(default=())

    def extra(self) -> dict[str, Any]:
        """Keys of recording.json that the contract does not name."""
        return dict(self.info.model_extra or {})
