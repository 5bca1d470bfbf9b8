"""A recording as MCAP, read back by the library's own reader and by the specification alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_bench import messages_of

from drivetwin.recording.mcap_file import write_mcap
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo

START = 1_700_000_000.5
ROWS = 3000


@pytest.fixture
def recording() -> Recording:
    random = np.random.default_rng(3)
    axes = {"lift": AxisInfo(joint="lift_joint"), "rotate": AxisInfo(joint="rotate_joint")}
    columns = {axis: {name: random.normal(size=ROWS) for name in ("position", "velocity", "torque")} for axis in axes}
    columns["lift"]["position_demand"] = np.where(np.arange(ROWS) < 5, np.nan, 0.25)
    info = RecordingInfo(machine="m", sample_period=0.001, axes=axes)
    return Recording("r", info, np.arange(ROWS) * np.float64(0.001), columns)


def test_both_readers_find_every_number(recording: Recording, tmp_path: Path) -> None:
    words = {"rotate": {"statusword": np.full(ROWS, 39.0)}}
    write_mcap(tmp_path / "r.mcap", recording, words, START)
    own = messages_of(tmp_path / "r.mcap")
    with (tmp_path / "r.mcap").open("rb") as stream:
        theirs = [(channel.topic, message.log_time, json.loads(message.data))
                  for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages()]  # fmt: skip
    assert sorted(own) == ["/joint_states", "/lift", "/rotate"]
    for topic, messages in own.items():
        assert [{"log_time": at} | told for name, at, told in theirs if name == topic] == messages
    for axis, named in recording.columns.items():
        for name in ("position", "velocity", "torque"):
            assert [message[name] for message in own[f"/{axis}"]] == named[name].tolist()
    assert [message.get("position_demand") for message in own["/lift"][3:7]] == [None, None, 0.25, 0.25]
    assert {message["statusword"] for message in own["/rotate"]} == {39}
    state = own["/joint_states"][7]
    assert state["name"] == ["lift_joint", "rotate_joint"]
    assert state["effort"] == [recording.columns[axis]["torque"][7] for axis in ("lift", "rotate")]
    assert state["log_time"] == round((START + 0.007) * 1e9)
    assert state["header"]["stamp"] == {"sec": 1_700_000_000, "nsec": 507_000_064}


def test_a_quantity_that_not_every_axis_has_is_in_no_joint_state(recording: Recording, tmp_path: Path) -> None:
    del recording.columns["lift"]["torque"]
    write_mcap(tmp_path / "r.mcap", recording, {}, START)
    state = messages_of(tmp_path / "r.mcap")["/joint_states"][0]
    assert (len(state["position"]), state["effort"]) == (2, [])


def test_every_channel_says_what_it_carries(recording: Recording, tmp_path: Path) -> None:
    write_mcap(tmp_path / "r.mcap", recording, {}, START)
    with (tmp_path / "r.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    described = {schema.name: json.loads(schema.data)["properties"] for schema in summary.schemas.values()}
    assert set(described["sensor_msgs/JointState"]) == {"header", "name", "position", "velocity", "effort"}
    assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}
    assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
