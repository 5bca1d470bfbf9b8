"""What remains, and when: intervals put into the gap after come out with their time, level and share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_bench import CAUSES, axis_of, coloured_noise, diagnosis_of, recording_of, time_of

from drivetwin.diagnosis.report.remains import intervals_after
from drivetwin.diagnosis.report.result import Array, Diagnosis

TIME = time_of(30.0)
NOISE = coloured_noise(np.random.default_rng(0), len(TIME), 0.02)
UNKNOWN = (replace(CAUSES[2], probability=1.0),)


def left(*after: Array) -> Diagnosis:
    """A diagnosis that leaves these gaps in recordings a, b, ... whose own time starts at 100 s."""
    runs = tuple(
        recording_of(TIME + 100.0, {"rotate": axis_of(TIME, gap + 1.0, after=gap)}, name)
        for name, gap in zip("ab", after, strict=False)
    )
    return diagnosis_of(runs, (), UNKNOWN)


def test_pulses_are_named_by_recording_and_time() -> None:
    pulses = np.where((TIME >= 12.0) & (TIME < 12.5), 0.5, 0.0) + np.where((TIME >= 20.0) & (TIME < 20.2), 0.4, 0.0)
    found = left(NOISE, NOISE + pulses)
    first, second, *others = intervals_after(found, "rotate")
    assert others == []
    assert (first.recording, second.recording) == ("b", "b")
    assert (first.begin, first.end) == pytest.approx((112.0, 112.5), abs=0.11)
    assert (second.begin, second.end) == pytest.approx((120.0, 120.2), abs=0.11)
    used = found.predictions[0].axes["rotate"].used
    inside = (TIME >= 12.0) & (TIME < 12.5) & used
    energy = np.sum((NOISE + pulses)[inside] ** 2)
    assert first.rms == pytest.approx(np.sqrt(energy / inside.sum()), rel=1e-6)
    whole = np.sum((NOISE + pulses)[used] ** 2) + np.sum(NOISE[used] ** 2)
    assert first.share == pytest.approx(energy / whole, rel=1e-6)


def test_what_is_spread_evenly_has_no_interval() -> None:
    assert intervals_after(left(0.3 * np.sin(200.0 * TIME)), "rotate") == ()
