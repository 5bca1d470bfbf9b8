"""Rows are samples in another order and back again; folds are contiguous blocks of time; pieces are spread over all of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import PERIOD, compared, strokes

from diagnosis.prepare.rows import BLOCK, ENOUGH, FOLDS, LONG, PIECE, Comparison
from diagnosis.prepare.motion import AxisRun, Run
from diagnosis.report.result import Array
from drivetwin.motion.axis_motion import widen
from drivetwin.motion.filtering import reach
from emulator.effects import library
from emulator.effects.backlash import Backlash

AXES = ("turn", "lift")


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    """Two recordings of different length."""
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, 25.0, name="one"), strokes(2, 14.0, name="other"))


def time_of(run: Run, _axis: AxisRun) -> Array:
    return run.recording.time


def chosen(run: Run, axis: str) -> Array:
    """Sample numbers that are compared: every stride-th, where it is fitted."""
    return np.array([k for k in range(0, len(run.recording.time), run.stride) if run.axes[axis].fitted[k]])


@pytest.mark.parametrize("axis", AXES)
def test_in_time_gives_the_fitted_samples_of_each_recording_in_order(comparison: Comparison, axis: str) -> None:
    back = comparison.in_time(axis, comparison.rows(axis, time_of))
    assert len(back) == 2
    for run, times in zip(comparison.runs, back, strict=True):
        np.testing.assert_array_equal(times, run.recording.time[chosen(run, axis)])


@pytest.mark.parametrize("axis", AXES)
def test_as_rows_is_the_reverse_of_in_time(comparison: Comparison, axis: str) -> None:
    rows = np.random.default_rng(0).standard_normal(len(comparison.target[axis]))
    np.testing.assert_array_equal(comparison.as_rows(axis, np.concatenate(comparison.in_time(axis, rows))), rows)


def test_target_is_measured_less_simulated(comparison: Comparison) -> None:
    told = comparison.in_time("lift", comparison.target["lift"])
    for run, gap in zip(comparison.runs, told, strict=True):
        picks = chosen(run, "lift")
        np.testing.assert_array_equal(gap, run.axes["lift"].torque[picks] - run.axes["lift"].base[picks])


@pytest.mark.parametrize("axis", AXES)
def test_folds_are_whole_blocks_of_time_dealt_in_turn(comparison: Comparison, axis: str) -> None:
    folds = comparison.folds[axis]
    assert [part.start for part in folds] == [0, *(part.stop for part in folds[:-1])]
    assert folds[-1].stop == len(comparison.target[axis])
    rows = np.empty(folds[-1].stop)
    for fold, part in enumerate(folds):
        rows[part] = fold
    first, second = comparison.in_time(axis, rows)
    times = comparison.in_time(axis, comparison.rows(axis, time_of))
    blocks_of_first = int(len(comparison.runs[0].recording.time) * PERIOD / BLOCK) + 1
    np.testing.assert_array_equal(first, np.floor(times[0] / BLOCK + 1e-9) % FOLDS)
    np.testing.assert_array_equal(second, (blocks_of_first + np.floor(times[1] / BLOCK + 1e-9)) % FOLDS)


def test_each_fold_has_its_share(comparison: Comparison) -> None:
    sizes = np.array([part.stop - part.start for part in comparison.folds["turn"]])
    assert sizes.min() > 0.5 * sizes.mean()


def test_durations_add_up_to_the_time_that_is_compared(comparison: Comparison) -> None:
    fitted = sum(float(np.sum(run.axes["turn"].fitted)) * run.period for run in comparison.runs)
    assert float(comparison.durations("turn").sum()) == pytest.approx(fitted, rel=0.01)


def test_an_effect_is_predicted_on_the_rows(comparison: Comparison) -> None:
    """A constant goes through the filter as it is, where the axis does not stick nearby."""
    offset = library()["torque_offset"](offset=1.3)  # type: ignore[call-arg]
    rows = comparison.predicted("turn", offset, comparison.simulation.dynamics()["turn"])  # type: ignore[arg-type]
    runs = comparison.runs
    far = 3 * reach(PERIOD, runs[0].cutoff_hz)
    moves = comparison.picked("turn", [~widen(run.axes["turn"].sticks, far) for run in runs]).astype(np.bool_)
    assert 0.5 < moves.mean() < 1.0
    np.testing.assert_allclose(rows[moves], -1.3, rtol=1e-3)


def test_a_search_begins_anew_where_an_axis_has_changed(comparison: Comparison) -> None:
    axis = comparison.simulation.dynamics()["turn"]
    friction = replace(axis.friction, coulomb=1.0, static_torque=1.5, stribeck_velocity=0.05)
    first, corrected, changed = (
        comparison.starts("turn", Backlash, replace(axis, friction=replace(friction, coulomb=level)))
        for level in (1.0, 1.0005, 1.01)
    )
    assert first is corrected
    assert changed is not first


def test_what_is_short_is_searched_whole(comparison: Comparison) -> None:
    assert comparison.sample is comparison


def test_a_sample_is_pieces_spread_over_a_long_recording(tmp_path: Path) -> None:
    long = compared(tmp_path, strokes(1, 3.0 * LONG))
    pieces = long.sample.runs
    assert [len(piece.recording.time) * PERIOD for piece in pieces] == pytest.approx([PIECE] * round(ENOUGH / PIECE))
    assert pieces[0].recording.time[0] == long.runs[0].recording.time[0]
    assert pieces[-1].recording.time[-1] == long.runs[0].recording.time[-1]
    begins = np.array([piece.recording.time[0] for piece in pieces])
    np.testing.assert_allclose(np.diff(begins), np.diff(begins).mean(), rtol=1e-3)
    whole = long.runs[0].axes["turn"]
    for piece in pieces:
        begin = round(piece.recording.time[0] / PERIOD)
        own = piece.axes["turn"]
        np.testing.assert_array_equal(own.torque, whole.torque[begin : begin + len(own.torque)])
        np.testing.assert_array_equal(own.motion.position, whole.motion.position[begin : begin + len(own.torque)])
        assert not own.fitted[0]
        assert not own.fitted[-1]
        assert np.all(whole.fitted[begin : begin + len(own.torque)] | ~own.fitted)


@pytest.mark.parametrize(
    ("seconds", "pieces"),
    [
        ((60.0, 60.0), [(0.0, 48.0), (0.0, 48.0)]),
        ((100.0, 20.0), [(0.0, 88.0), (6.0,)]),
        ((90.0, 5.0), [(0.0, 39.0, 78.0), (0.0,)]),
    ],
)
def test_each_recording_has_its_share_of_a_sample(
    tmp_path: Path, seconds: tuple[float, ...], pieces: list[tuple[float, ...]]
) -> None:
    runs = [strokes(number, length, name=f"{number}") for number, length in enumerate(seconds, 1)]
    sample = compared(tmp_path, *runs).sample
    begins = {name: [run.recording.time[0] for run in sample.runs if run.recording.name == name] for name in ("1", "2")}
    assert begins["1"] == pytest.approx(pieces[0], abs=PERIOD)
    assert begins["2"] == pytest.approx(pieces[1], abs=PERIOD)


def test_of_short_recordings_no_sample_is_taken_that_is_hardly_shorter(tmp_path: Path) -> None:
    many = compared(tmp_path, *(strokes(number, 10.0, name=f"{number}") for number in range(1, 10)))
    assert many.duration > LONG
    assert many.sample is many


def test_no_sample_is_taken_that_misses_where_an_axis_moved(tmp_path: Path) -> None:
    long = compared(tmp_path, strokes(1, 3.0 * LONG))
    whole = long.runs[0]
    between = np.zeros(len(whole.recording.time), dtype=np.bool_)
    between[round((PIECE + 1.0) / PERIOD) : round((PIECE + 7.0) / PERIOD)] = True
    turn = replace(whole.axes["turn"], fitted=whole.axes["turn"].fitted & between)
    briefly = Comparison(long.simulation, [replace(whole, axes={**whole.axes, "turn": turn})])
    assert briefly.count("turn") > 0
    assert briefly.sample is briefly
