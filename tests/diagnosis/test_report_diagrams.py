"""The arrays behind the report's diagrams against plain numpy."""

from __future__ import annotations

import numpy as np
import pytest
from report_case import CUTOFF, coloured_noise, recording_of, slowly, swinging, time_of

from drivetwin.diagnosis.report.view import drawn, gap_map, mean_over, spectra_of, trace_of, worst_window


def test_the_worst_window_is_where_the_gap_was_put() -> None:
    time = time_of(60.0)
    gap = np.where((time > 31.0) & (time < 33.0), 1.0, 0.1)
    low, high = worst_window(trace_of([recording_of(time, gap)], "rotate", CUTOFF), 4.0)
    assert low < 31.05
    assert high > 32.95
    assert high - low == pytest.approx(4.0, abs=0.02)


def test_recordings_stand_one_after_the_other_with_a_break() -> None:
    runs = [recording_of(time_of(5.0), np.zeros(5000), name) for name in "ab"]
    trace = trace_of(runs, "rotate", CUTOFF)
    assert trace.starts == pytest.approx((0.0, 5.0))
    assert np.isnan(trace.time).sum() == 1
    assert np.nanmax(trace.time) == pytest.approx(10.0, abs=0.01)


def test_a_long_recording_is_thinned_but_not_where_it_is_looked_at_first() -> None:
    time = time_of(500.0)
    run = recording_of(time, np.zeros_like(time))
    trace = trace_of([run, run], "rotate", CUTOFF)
    assert 1.0 / np.nanmedian(np.diff(trace.time)) >= 4.0 * CUTOFF
    points = drawn(trace, (100.0, 104.0))
    assert len(points) < 45_000 < len(trace.time)
    shown = trace.time[points]
    assert np.isnan(shown).sum() == 1, "two recordings are not joined by a line"
    inside = (trace.time >= 97.0) & (trace.time <= 107.0)
    assert np.array_equal(shown[(shown >= 97.0) & (shown <= 107.0)], trace.time[inside])


def test_the_map_s_cells_are_rms_of_what_is_in_them() -> None:
    time = time_of(60.0)
    position = swinging(time)[0]
    trace = trace_of([recording_of(time, 0.3 * position)], "rotate", CUTOFF)
    found = gap_map(trace)
    row, column = np.unravel_index(np.nanargmax(found.before), found.before.shape)
    inside = (
        trace.used
        & (trace.position >= found.position[column])
        & (trace.position < found.position[column + 1])
        & (trace.velocity >= found.velocity[row])
        & (trace.velocity < found.velocity[row + 1])
    )
    assert found.before[row, column] == pytest.approx(np.sqrt(np.mean((0.3 * trace.position[inside]) ** 2)), rel=1e-6)
    assert np.nanmax(found.after) == pytest.approx(0.0, abs=1e-12)


def test_the_spectrum_of_noise_lies_on_the_noise_s_own() -> None:
    time = time_of(200.0)
    noise = coloured_noise(len(time), 0.05)
    found = spectra_of([recording_of(time, noise)], "rotate", 0.05, CUTOFF)
    band = found.frequency < 0.8 * CUTOFF
    assert np.mean(found.before[band] / found.noise[band]) == pytest.approx(1.0, abs=0.08)


def test_recordings_of_two_rates_are_drawn_each_at_its_own() -> None:
    """A gap of 20 Hz in a recording at 1 kHz, beside a slow one that can have no more than 4 Hz."""
    time = time_of(20.0)
    fast = recording_of(time, 0.5 * np.sin(2.0 * np.pi * 20.0 * time))
    slow = slowly(recording_of(time, np.zeros_like(time), "slow"), 100)
    trace = trace_of([slow, fast], "rotate", CUTOFF)
    step = np.diff(trace.time[~np.isnan(trace.time)])
    assert step[:190] == pytest.approx(0.1)
    assert 1.0 / step[-1] >= 4.0 * CUTOFF
    found = spectra_of([slow, fast], "rotate", 0.05, CUTOFF)
    assert found.frequency[np.argmax(found.before)] == pytest.approx(20.0, abs=0.5)
    total = np.sum(found.before) * (found.frequency[1] - found.frequency[0])
    assert total == pytest.approx(0.125, rel=0.05)
    low, high = worst_window(trace, 4.0)
    assert low > 20.0
    assert high - low == pytest.approx(4.0, abs=0.02)


def test_the_mean_over_velocity_does_not_join_both_directions() -> None:
    velocity = np.linspace(-1.0, 1.0, 2001)
    centre, mean = mean_over(velocity, np.sign(velocity) + 0.5 * velocity)
    at = np.flatnonzero(np.isnan(mean))
    assert list(centre[at]) == [0.0]
    assert np.nanmax(np.abs(mean - np.sign(centre) - 0.5 * centre)) < 0.03
