"""A recording as MCAP, which Foxglove and Rerun open: a channel an axis, and all of them as joint states."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.recording.recording import Recording, Samples

JOINT_STATES = "/joint_states"

PROFILE = "drivetwin"

_NUMBER = {"type": "number"}
_STAMP = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
_NUMBERS = {"type": "array", "items": _NUMBER}

_OF_JOINTS = {
    "header": {"type": "object", "properties": {"stamp": _STAMP, "frame_id": {"type": "string"}}},
    "name": {"type": "array", "items": {"type": "string"}},
    "position": _NUMBERS,
    "velocity": _NUMBERS,
    "effort": _NUMBERS,
}
"""Fields of ROS' sensor_msgs/JointState; a quantity that no axis has is empty."""

_QUANTITIES = {"position": "position", "velocity": "velocity", "effort": "torque"}
"""Columns of the recording behind them."""


def write_mcap(path: Path, recording: Recording, more: Mapping[str, Mapping[str, Samples]], start: float) -> None:
    """Write `recording` as the file `path`; its time 0 is `start` [s since 1970].

    An axis A has the topic /A, messages in JSON with the columns of the recording in their units, and what `more` has of it,
    `more[A][column]` (n,). What is not a number is left out. The joints are named as in the MuJoCo model.
    """
    from mcap.writer import Writer  # noqa: PLC0415  # an extra: nothing but this file needs it

    with path.open("wb") as stream:
        writer: Any = Writer(stream)
        writer.start(PROFILE, library="drivetwin")
        axes = {axis: dict(named) | dict(more.get(axis, {})) for axis, named in recording.columns.items()}
        topics = {axis: _topic(writer, f"/{axis}", f"{PROFILE}.Axis", _axis_fields(named)) for axis, named in axes.items()}
        joints = _topic(writer, JOINT_STATES, "sensor_msgs/JointState", _OF_JOINTS)
        states = _joint_states(recording)
        for row, time in enumerate(recording.time.tolist()):
            now = round((start + time) * 1e9)
            stamp = {"sec": now // 1_000_000_000, "nsec": now % 1_000_000_000}
            for axis, named in axes.items():
                values = {name: value for name, column in named.items() if isfinite(value := float(column[row]))}
                _add(writer, topics[axis], now, {"timestamp": stamp, **values})
            _add(writer, joints, now, {"header": {"stamp": stamp, "frame_id": ""}, **next(states)})
        writer.finish()


def _axis_fields(named: Mapping[str, Samples]) -> dict[str, Any]:
    return {"timestamp": _STAMP, **{name: {**_NUMBER, "title": name.replace("_", " ")} for name in named}}


def _joint_states(recording: Recording) -> Iterator[dict[str, object]]:
    """Of each row."""
    names = [recording.info.axes[axis].joint for axis in recording.columns]
    columns = {
        quantity: np.column_stack([recording.columns[axis][column] for axis in recording.columns])
        for quantity, column in _QUANTITIES.items()
        if all(column in named for named in recording.columns.values())
    }
    for row in range(len(recording.time)):
        told = {quantity: values[row].tolist() for quantity, values in columns.items() if np.isfinite(values[row]).all()}
        yield {"name": names, **{quantity: told.get(quantity, []) for quantity in _QUANTITIES}}


def _topic(writer: Any, topic: str, schema: str, fields: Mapping[str, object]) -> int:
    described = {"title": schema, "type": "object", "properties": fields}
    schema_id = writer.register_schema(name=schema, encoding="jsonschema", data=json.dumps(described).encode())
    return int(writer.register_channel(topic=topic, message_encoding="json", schema_id=schema_id))


def _add(writer: Any, channel: int, now: int, told: Mapping[str, object]) -> None:
    writer.add_message(channel_id=channel, log_time=now, publish_time=now, data=json.dumps(told).encode())
