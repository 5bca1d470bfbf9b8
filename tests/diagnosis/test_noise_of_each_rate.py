"""A sensor's noise in recordings of several sample rates: less of it is in the compared band of a faster one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import compared, strokes

from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.explained import colours_of
from drivetwin.recording.recording import Recording

SLOWER = 4


def slowly(recording: Recording) -> Recording:
    """Every fourth sample of it."""
    columns = {axis: {name: values[::SLOWER] for name, values in own.items()} for axis, own in recording.columns.items()}
    info = recording.info.model_copy(update={"sample_period": SLOWER * recording.info.sample_period})
    return replace(recording, info=info, time=recording.time[::SLOWER], columns=columns)


def test_rows_of_each_rate_have_the_noise_of_that_rate(tmp_path: Path) -> None:
    """White noise of one level, of 500 and 125 samples a second: its density goes with the sample period."""
    rows = compared(tmp_path, strokes(1, 40.0, noise=200.0), slowly(strokes(2, 40.0, name="slow", noise=200.0)))
    bench = bench_of(rows, Settings(), {"turn": True, "lift": True})
    colour = colours_of(bench, dict(rows.target))["turn"]
    own = rows.of["turn"].run
    noise = [colour.whiten(rows.target["turn"])[own == k] for k in (0, 1)]
    assert [np.std(each) for each in noise] == pytest.approx([1.0, 1.0], rel=0.1)
    level = [float(np.std(rows.target["turn"][own == k])) for k in (0, 1)]
    assert level[1] == pytest.approx(np.sqrt(SLOWER) * level[0], rel=0.1)
