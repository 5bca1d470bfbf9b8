"""Recordings of any axes, columns, samples and keys, written and read back, are the same to the bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import COLUMNS, ONE_OF, TORQUE, AxisInfo, DriveLoops, Recording, RecordingInfo, Samples
from drivetwin.recording.writer import write_recording

FINITE = st.floats(allow_nan=False, allow_infinity=False)
MEASURED = (TORQUE, *ONE_OF)
NAMES = st.text(st.characters(codec="utf-8", categories=("L", "N")), min_size=1, max_size=8)


def samples(count: int, measured: bool) -> st.SearchStrategy[Samples]:
    """What was not measured in a row is NaN, where the contract allows it."""
    values = FINITE if measured else st.one_of(FINITE, st.just(float("nan")))
    return st.lists(values, min_size=count, max_size=count).map(np.array)


@st.composite
def axis(draw: st.DrawFn, count: int, joint: str) -> tuple[AxisInfo, dict[str, Samples]]:
    needed = {TORQUE, draw(st.sampled_from(ONE_OF))}
    names = needed | draw(st.sets(st.sampled_from(COLUMNS)))
    columns = {name: draw(samples(count, name in MEASURED)) for name in COLUMNS if name in names}
    told = draw(st.fixed_dictionaries({}, optional={
        "rated_torque": st.floats(1e-9, 1e9), "torque_delay": FINITE, "position_relative": st.booleans(), "colour": NAMES,
        "drive": st.builds(DriveLoops, position_gain=st.floats(0.0, 1e9), integral_time=st.none() | st.floats(0.0, 1e9)),
    }))  # fmt: skip
    return AxisInfo.model_validate({"joint": joint} | told), columns


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    count, period = draw(st.integers(2, 40)), draw(st.sampled_from([1e-4, 1e-3, 0.004, 0.1]))
    names = draw(st.lists(NAMES, min_size=1, max_size=3, unique=True))
    axes = {name: draw(axis(count, name)) for name in names}
    told = {
        "machine": draw(NAMES),
        "sample_period": period,
        "start_time": draw(st.none() | st.floats(0.0, 1e9) | st.datetimes()),
        "axes": {name: own for name, (own, _) in axes.items()},
        "operator": draw(NAMES),
    }
    info = RecordingInfo.model_validate(told)
    time = np.arange(count, dtype=np.float64) * period
    return Recording("run", info, time, {name: columns for name, (_, columns) in axes.items()})


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(written=recordings())
def test_recordings_come_back_as_they_were(tmp_path: Path, written: Recording) -> None:
    write_recording(written, tmp_path / "run")
    (read,) = read_recording(tmp_path / "run")
    np.testing.assert_array_equal(read.time, written.time)
    assert read.columns.keys() == written.columns.keys()
    for name, columns in written.columns.items():
        assert read.columns[name].keys() == columns.keys()
        for column, values in columns.items():
            np.testing.assert_array_equal(read.columns[name][column], values)
    assert read.info.axes == written.info.axes
    assert (read.info.machine, read.info.sample_period) == (written.info.machine, written.info.sample_period)
    assert read.info.start_time == written.info.start_time
    assert read.extra()["operator"] == written.extra()["operator"]
