"""What recording/2 adds: recordings without torque, sensors behind the transmission, times, and numbers that cannot be."""

from __future__ import annotations

import copy
import json
import math
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.reader import check_torque, read_recording
from drivetwin.recording.recording import DriveLaw, DriveLoops, Recording, RecordingInfo
from drivetwin.recording.writer import write_recording

INFO: dict[str, Any] = {
    "schema": "recording/2",
    "machine": "bench",
    "sample_period": 0.01,
    "axes": {
        "elbow": {"joint": "elbow", "drive": {"position_gain": 20.0, "velocity_gain": 3.0}},
        "wrist": {"joint": "wrist"},
    },
}
NAMES = ("torque", "position")


def write(folder: Path, info: dict[str, Any] = INFO, names: tuple[str, ...] = NAMES, *, still: bool = False) -> Path:
    """A recording as anyone could have written it: no writer of this project takes part."""
    period = info["sample_period"]
    time = np.arange(20) * (period if math.isfinite(period) else 0.01)
    columns = {f"{axis}.{name}": np.zeros(20) if still else np.sin(time) for axis in info["axes"] for name in names}
    folder.mkdir()
    (folder / "recording.json").write_text(json.dumps(info))
    pq.write_table(pa.table({"time": time, **columns}), folder / "signals.parquet")
    return folder


def changed(value: object, *keys: str) -> dict[str, Any]:
    """INFO with one value set, which may be deep inside."""
    info = copy.deepcopy(INFO)
    inner = info
    for key in keys[:-1]:
        inner = inner[key]
    inner[keys[-1]] = value
    return info


@pytest.mark.parametrize("schema", ["recording/1", "recording/2"])
def test_both_schemas_are_read_and_the_second_is_written(schema: str, tmp_path: Path) -> None:
    (read,) = read_recording(write(tmp_path / "run", INFO | {"schema": schema}))
    write_recording(read, tmp_path / "again")
    assert json.loads((tmp_path / "again" / "recording.json").read_text())["schema"] == "recording/2"
    (again,) = read_recording(tmp_path / "again")
    np.testing.assert_array_equal(again.columns["wrist"]["torque"], read.columns["wrist"]["torque"])


def test_without_torque_position_and_demand_are_enough(tmp_path: Path) -> None:
    (read,) = read_recording(write(tmp_path / "run", names=("position", "position_demand")))
    assert set(read.columns["elbow"]) == {"position", "position_demand"}
    with pytest.raises(UserError, match=r"signals\.parquet: column elbow\.torque is missing .* which drivetwin fit needs"):
        check_torque(read, "drivetwin fit")


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("position",), r"elbow\.torque is missing .* without it elbow\.position_demand is required"),
        (("position_demand",), r"without it elbow\.position is required"),
        (("velocity", "velocity_demand"), r"without it elbow\.position and elbow\.position_demand is required"),
        (("torque", "position_demand"), r"one of elbow\.position or elbow\.velocity is required"),
    ],
)
def test_what_is_required(names: tuple[str, ...], message: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=message):
        read_recording(write(tmp_path / "run", names=names))


def test_the_first_schema_requires_torque(tmp_path: Path) -> None:
    folder = write(tmp_path / "run", INFO | {"schema": "recording/1"}, ("position", "position_demand"))
    with pytest.raises(UserError, match=r"required column elbow\.torque is missing .*write it as recording/2"):
        read_recording(folder)


@pytest.mark.parametrize(("names", "refused"), [(("position", "position_demand"), True), ((*NAMES, "position_demand"), False)])
def test_a_demand_has_no_hole_where_it_is_required(names: tuple[str, ...], refused: bool, tmp_path: Path) -> None:
    folder = write(tmp_path / "run", names=names)
    columns = dict(pq.read_table(folder / "signals.parquet").to_pydict())
    columns["wrist.position_demand"][4] = float("nan")
    pq.write_table(pa.table(columns), folder / "signals.parquet")
    if refused:
        with pytest.raises(UserError, match=r"wrist\.position_demand is nan at row 5"):
            read_recording(folder)
    else:
        assert len(read_recording(folder)) == 1


def test_sensors_behind_the_transmission_come_back(tmp_path: Path) -> None:
    names = (*NAMES, "joint_position", "joint_velocity", "joint_torque", "temperature")
    (read,) = read_recording(write(tmp_path / "run", names=names))
    write_recording(read, tmp_path / "again")
    assert pq.read_schema(tmp_path / "again" / "signals.parquet").names[1:7] == [f"elbow.{name}" for name in names]


@pytest.mark.parametrize(
    ("told", "read"),
    [
        (12, 12.0),
        (0.5, 0.5),
        (None, None),
        ("2026-11-23T08:15:00.250Z", datetime(2026, 11, 23, 8, 15, 0, 250000, UTC)),
        ("2026-11-23 09:15:00", datetime(2026, 11, 23, 9, 15)),
    ],
)
def test_start_time(told: object, read: object, tmp_path: Path) -> None:
    (recording,) = read_recording(write(tmp_path / "run", INFO | {"start_time": told}))
    assert recording.info.start_time == read
    write_recording(recording, tmp_path / "again")
    (again,) = read_recording(tmp_path / "again")
    assert again.info.start_time == read


def test_instants_of_two_recordings_compare(tmp_path: Path) -> None:
    starts = ["2026-11-23T08:15:00Z", "2026-11-23T10:15:00+01:00"]
    infos = [read_recording(write(tmp_path / text, INFO | {"start_time": text}))[0].info for text in starts]
    first, second = (info.start_time for info in infos)
    assert isinstance(first, datetime)
    assert isinstance(second, datetime)
    assert second - first == timedelta(hours=1)


def test_what_is_not_told_of_an_axis_is_not_known() -> None:
    info = RecordingInfo.model_validate(INFO)
    axis = info.axes["elbow"]
    assert (info.start_time, axis.torque_bandwidth_hz, axis.torque_delay, axis.position_relative) == (None, None, None, False)


def test_what_is_told_of_a_channel_comes_back(tmp_path: Path) -> None:
    told = {"joint": "elbow", "torque_bandwidth_hz": 800.0, "torque_delay": 0.00025, "position_relative": True}
    (read,) = read_recording(write(tmp_path / "run", changed(told, "axes", "elbow")))
    axis = read.info.axes["elbow"]
    assert (axis.torque_bandwidth_hz, axis.torque_delay, axis.position_relative) == (800.0, 0.00025, True)


@pytest.mark.parametrize(
    ("told", "law"),
    [
        ({"position_gain": 20.0}, DriveLaw.CASCADE),
        ({"velocity_gain": 0.0}, DriveLaw.CASCADE),
        ({}, DriveLaw.UNKNOWN),
        ({"torque_limit": 3.0, "position_gain": None}, DriveLaw.UNKNOWN),
        *(({"position_gain": 20.0, "law": law.value}, law) for law in DriveLaw),
    ],
)
def test_law_of_the_drive(told: dict[str, Any], law: DriveLaw) -> None:
    assert DriveLoops.model_validate(told).law is law


GAINS = (
    "position_gain",
    "velocity_gain",
    "integral_time",
    "velocity_feedforward",
    "torque_limit",
    "servo_period",
    "velocity_filter_hz",
    "current_loop_time_constant",
)
OF_AXIS = ("rated_torque", "gear_ratio", "torque_resolution", "position_resolution", "torque_bandwidth_hz")


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 10**400])
@pytest.mark.parametrize("key", [*OF_AXIS, *(f"drive.{key}" for key in GAINS)])
def test_numbers_that_cannot_be_are_refused_by_key(key: str, value: float, tmp_path: Path) -> None:
    folder = write(tmp_path / "run", changed(value, "axes", "elbow", *key.split(".")))
    with pytest.raises(UserError, match=rf"recording\.json: axes\.elbow\.{key}: ") as refused:
        read_recording(folder)
    assert len(str(refused.value)) < 400


@pytest.mark.parametrize(
    ("info", "message"),
    [
        (changed(0.0, "axes", "elbow", "gear_ratio"), r"axes\.elbow\.gear_ratio: .*greater than 0"),
        (changed(float("inf"), "axes", "elbow", "torque_delay"), r"axes\.elbow\.torque_delay: .*finite"),
        (changed("p", "axes", "elbow", "drive", "law"), r"axes\.elbow\.drive\.law: .*'cascade', 'pid', 'pd_position_servo'"),
        (changed("elbow", "axes", "wrist", "joint"), r"axes: axes elbow and wrist are both on joint 'elbow'"),
        (changed(float("inf"), "sample_period"), r"sample_period: .*finite"),
        (changed(-1.0, "start_time"), r"start_time: expected seconds since .*\(got -1\.0\)"),
        (changed(True, "start_time"), r"start_time: expected seconds"),
        (changed("2026-11-23", "start_time"), r"start_time: expected seconds since .* ISO date and time"),
        (changed("10:99", "start_time"), r"start_time: expected seconds"),
    ],
)
def test_refusals_of_recording_json(info: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=message):
        read_recording(write(tmp_path / "run", info))


@pytest.mark.parametrize("period", [0.25, 0.0002])
@pytest.mark.parametrize("still", [False, True])
def test_rates_and_standstill_are_no_reason_to_refuse(period: float, still: bool, tmp_path: Path) -> None:
    (read,) = read_recording(write(tmp_path / "run", INFO | {"sample_period": period}, still=still))
    assert isinstance(read, Recording)
    assert read.info.sample_period == period
