"""A recording in memory: the samples of each axis and what is known of it (contract recording/1)."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat

SCHEMA = "recording/1"

Samples = NDArray[np.float64]

REQUIRED = ("torque",)
ONE_OF = ("position", "velocity")
OPTIONAL = ("position_demand", "velocity_demand", "velocity_offset", "torque_offset", "temperature")
COLUMNS = (*REQUIRED, *ONE_OF, *OPTIONAL)


class DriveLoops(BaseModel):
    """What a replay needs of the drive; units as in the contract, joint side."""

    model_config = ConfigDict(extra="allow")

    position_gain: float | None = None
    velocity_gain: float | None = None
    integral_time: float | None = None
    velocity_feedforward: float = 1.0
    torque_limit: float | None = None
    servo_period: float | None = None
    velocity_filter_hz: float | None = None
    current_loop_time_constant: float | None = None


class AxisInfo(BaseModel):
    """One entry of `axes` in recording.json."""

    model_config = ConfigDict(extra="allow")

    joint: str
    actuator: str | None = None
    rated_torque: PositiveFloat | None = None
    torque_resolution: float | None = None
    position_resolution: float | None = None
    gear_ratio: float | None = None
    drive: DriveLoops | None = None


class RecordingInfo(BaseModel):
    """recording.json; keys that the contract does not name are kept."""

    model_config = ConfigDict(extra="allow", populate_by_name=True)

    schema_: str = Field(default=SCHEMA, alias="schema")
    machine: str
    sample_period: PositiveFloat
    derived: list[str] = []
    axes: dict[str, AxisInfo] = Field(min_length=1)


@dataclass(frozen=True)
class Recording:
    """Samples of one recording.

    `time` is (n,) [s], rising in equal steps; `columns[axis][name]` is (n,) in SI units on the joint side.
    `source` is the directory it was read from, None where it has not been written yet.
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
