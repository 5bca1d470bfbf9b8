"""Recordings on disk: round trip, and everything that the contract refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.recording.reader import check_joints, find_recordings, read_recording
from drivetwin.recording.recording import Recording, RecordingInfo
from drivetwin.recording.writer import write_into, write_recording

INFO = {
    "schema": "recording/2",
    "machine": "bench",
    "sample_period": 0.001,
    "derived": ["elbow.position"],
    "operator": "somebody",
    "axes": {
        "elbow": {
            "joint": "elbow",
            "rated_torque": 20.0,
            "colour": "blue",
            "drive": {"position_gain": 20.0, "integral_time": None, "firmware": "1.2"},
        }
    },
}


def recording(samples: int = 50) -> Recording:
    time = 3.7 + np.arange(samples, dtype=np.float64) * 0.001
    columns = {"elbow": {"torque": np.sin(time), "position": time**2, "temperature": np.full(samples, np.nan)}}
    return Recording("run", RecordingInfo.model_validate(INFO), time, columns)


def table(folder: Path) -> dict[str, list[Any]]:
    return dict(pq.read_table(folder / "signals.parquet").to_pydict())


def test_round_trip_keeps_every_bit_and_every_key(tmp_path: Path) -> None:
    source = tmp_path / "source.txt"
    source.write_text("raw")
    written = recording()
    write_recording(written, tmp_path / "run", seed=7, inputs=[source])
    (read,) = read_recording(tmp_path / "run")
    assert read.name == "run"
    np.testing.assert_array_equal(read.time, written.time)
    for name, values in written.columns["elbow"].items():
        np.testing.assert_array_equal(read.columns["elbow"][name], values)
    payload = json.loads((tmp_path / "run" / "recording.json").read_text())
    assert payload["seed"] == 7
    assert payload["version"]
    assert list(payload["inputs"]) == [str(source)]
    assert {key: payload[key] for key in INFO} == INFO
    assert read.extra()["operator"] == "somebody"


def test_writing_into_a_staged_folder(tmp_path: Path) -> None:
    write_into(recording(), tmp_path / "runs" / "one")
    write_into(recording(), tmp_path / "runs" / "two")
    assert [path.name for path in find_recordings(tmp_path / "runs")] == ["one", "two"]
    assert find_recordings(tmp_path / "runs" / "one") == [tmp_path / "runs" / "one"]
    with pytest.raises(UserError, match=r"holds no recording\.json"):
        find_recordings(tmp_path)


def test_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    whole = recording()
    columns = {"elbow": {**whole.columns["elbow"], "torque": np.zeros(3)}}
    with pytest.raises(UserError, match=r"elbow\.torque has 3 values"):
        write_recording(replace(whole, columns=columns), tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_csv_is_read_as_parquet_is(tmp_path: Path) -> None:
    write_recording(recording(), tmp_path / "run")
    columns = table(tmp_path / "run")
    lines = [",".join(columns)]
    lines += [
        ",".join("" if np.isnan(cell) else repr(cell) for cell in row) for row in zip(*columns.values(), strict=True)
    ]
    (tmp_path / "run" / "signals.parquet").unlink()
    (tmp_path / "run" / "signals.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(UserError, match="temperature has 0 values"):
        read_recording(tmp_path / "run")
    kept = [line.rpartition(",")[0] for line in lines]
    (tmp_path / "run" / "signals.csv").write_text("\n".join(kept) + "\n")
    (read,) = read_recording(tmp_path / "run")
    np.testing.assert_array_equal(read.time, recording().time)
    np.testing.assert_array_equal(read.columns["elbow"]["torque"], recording().columns["elbow"]["torque"])


Columns = dict[str, list[Any]]


def _drop(name: str) -> Callable[[Columns], Any]:
    return lambda columns: columns.pop(name)


def _set(name: str, row: int, value: float | None) -> Callable[[Columns], Any]:
    return lambda columns: columns[name].__setitem__(row, value)


def _rename(old: str, new: str) -> Callable[[Columns], Any]:
    return lambda columns: columns.__setitem__(new, columns.pop(old))


def _rename_axis(old: str, new: str) -> Callable[[Columns], Any]:
    def spoil(columns: Columns) -> None:
        for name in [each for each in columns if each.startswith(f"{old}.")]:
            columns[f"{new}.{name.removeprefix(f'{old}.')}"] = columns.pop(name)

    return spoil


def _cut(first: int, last: int) -> Callable[[Columns], Any]:
    def cut(columns: Columns) -> None:
        for values in columns.values():
            del values[first:last]

    return cut


REFUSED = {
    "no time": (_drop("time"), r"column time is missing"),
    "no torque": (_drop("elbow.torque"), r"elbow\.torque is missing"),
    "neither position nor velocity": (_drop("elbow.position"), r"elbow\.position or elbow\.velocity"),
    "only a lookalike": (_rename("elbow.torque", "elbow.Torque"), r"elbow\.torque is missing"),
    "axis of another name": (_rename_axis("elbow", "elbo"), r"no column is of this axis; correct its name in recording\.json"),
    "shorter column": (_set("elbow.torque", 49, None), r"elbow\.torque has 49 values, time has 50"),
    "hole": (_set("elbow.torque", 10, None), r"elbow\.torque is nan at row 11"),
    "NaN": (_set("elbow.position", 10, float("nan")), r"elbow\.position is nan at row 11"),
    "infinity": (_set("elbow.torque", 10, float("-inf")), r"elbow\.torque is -inf at row 11"),
    "NaN in time": (_set("time", 10, float("nan")), r"time is nan at row 11"),
    "time stands still": (_set("time", 10, 3.709), r"time falls or stands still at row 11"),
    "jitter": (_set("time", 10, 3.71002), r"time steps by 0\.00102 s at row 11"),
    "gap": (_cut(20, 25), r"gap of 0\.006 s before row 21 .*about 5 samples.*--allow-gaps"),
    "nothing left": (_cut(1, 50), r"time has 1 row"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refusals_name_file_column_and_row(case: str, tmp_path: Path) -> None:
    spoil, message = REFUSED[case]
    write_recording(recording(), tmp_path / "run")
    columns = table(tmp_path / "run")
    spoil(columns)
    file = tmp_path / "run" / "signals.parquet"
    pq.write_table(pa.table({name: pa.array(values, pa.float64()) for name, values in columns.items()}), file)
    with pytest.raises(UserError, match=message) as refused:
        read_recording(tmp_path / "run")
    assert str(file) in str(refused.value)
    assert "row" in str(refused.value)


def test_one_percent_of_jitter_is_allowed(tmp_path: Path) -> None:
    write_recording(recording(), tmp_path / "run")
    columns = table(tmp_path / "run")
    columns["time"][10] += 0.0000099
    pq.write_table(pa.table(columns), tmp_path / "run" / "signals.parquet")
    assert len(read_recording(tmp_path / "run")) == 1


def test_gaps_split_where_allowed(tmp_path: Path) -> None:
    write_recording(recording(), tmp_path / "run")
    columns = table(tmp_path / "run")
    _cut(20, 25)(columns)
    pq.write_table(pa.table(columns), tmp_path / "run" / "signals.parquet")
    first, second = read_recording(tmp_path / "run", allow_gaps=True)
    assert (first.name, second.name) == ("run-1", "run-2")
    assert (len(first.time), len(second.time)) == (20, 25)
    np.testing.assert_array_equal(second.columns["elbow"]["torque"], recording().columns["elbow"]["torque"][25:])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "recording/3"}, r"schema is 'recording/3'.*'recording/1' and 'recording/2'"),
        ({"schema": None}, r"schema is None"),
        ({"sample_period": 0}, r"sample_period: .*greater than 0"),
        ({"sample_period": 0.002}, r"time steps by 0\.001 s .*sample_period says 0\.002"),
        ({"axes": {"elbow": {}}}, r"axes\.elbow\.joint"),
    ],
)
def test_refusals_of_recording_json(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    write_recording(recording(), tmp_path / "run")
    (tmp_path / "run" / "recording.json").write_text(json.dumps(INFO | change))
    with pytest.raises(UserError, match=message):
        read_recording(tmp_path / "run")


def test_not_a_recording(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does not exist"):
        read_recording(tmp_path)
    (tmp_path / "recording.json").write_text("{,")
    with pytest.raises(UserError, match="line 1 column 2: not JSON"):
        read_recording(tmp_path)
    (tmp_path / "recording.json").write_text(json.dumps(INFO))
    with pytest.raises(UserError, match=r"neither signals\.parquet nor signals\.csv"):
        read_recording(tmp_path)
    (tmp_path / "signals.parquet").write_text("not parquet")
    with pytest.raises(UserError, match="cannot be read as Parquet"):
        read_recording(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("time,elbow.torque,elbow.position\n0,1\n", r"elbow\.position has 0 values"),
        ("time,elbow.torque,elbow.position\n0,1,2\n0.001,x,2\n", r"column elbow\.torque row 2: 'x'"),
        ("time,elbow.torque,elbow.position\n0,1,2,3\n", r"row 1 has 4 values for 3 columns"),
        ("time,time\n0,1\n", "column time stands twice"),
        ("time,elbow.torque,elbow.position\n0,1,2\n0.001,1,\n", r"elbow\.position has 1 values, time has 2"),
    ],
)
def test_refusals_of_signals_csv(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "recording.json").write_text(json.dumps(INFO))
    (tmp_path / "signals.csv").write_text(text)
    with pytest.raises(UserError, match=message):
        read_recording(tmp_path)


def test_joint_that_the_model_lacks() -> None:
    check_joints(recording(), ["elbow", "wrist"])
    with pytest.raises(UserError, match=r"axis elbow .*joint 'elbow'.*its joints: wrist"):
        check_joints(recording(), ["wrist"])
