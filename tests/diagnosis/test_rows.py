"""Rows are the fitted samples of each axis in the order of time; blocks are contiguous; a part is spread over all of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import PERIOD, compared, ready, strokes
from scipy.interpolate import CubicSpline

from drivetwin.diagnosis.prepare import rows as of_rows
from drivetwin.diagnosis.prepare.rows import ENOUGH, MUCH, Rows
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import AxisEffect
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.emulator.effects.coulomb import Coulomb
from drivetwin.emulator.effects.elasticity import Elasticity
from drivetwin.emulator.effects.presliding import Presliding
from drivetwin.emulator.effects.torque_offset import TorqueOffset
from drivetwin.emulator.effects.torque_ripple import TorqueRipple
from drivetwin.motion.filtering import reach
from drivetwin.motion.moving import widen
from drivetwin.recording.recording import Recording

AXES = ("turn", "lift")
PIECES_OF = of_rows._pieces


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Rows:
    """Two recordings of different length."""
    return compared(tmp_path_factory.mktemp("rig"), strokes(1, 25.0, name="one"), strokes(2, 14.0, name="other"))


def chosen(run: Run, axis: str) -> Array:
    """Sample numbers that are compared: every stride-th, where it is fitted."""
    return np.array([k for k in range(0, len(run.recording.time), run.stride) if run.axes[axis].fitted[k]])


@pytest.mark.parametrize("axis", AXES)
def test_rows_are_the_fitted_samples_of_each_recording_in_order(rows: Rows, axis: str) -> None:
    times = rows.rows(axis, lambda run, _: run.recording.time)
    expected = [run.recording.time[chosen(run, axis)] for run in rows.runs]
    np.testing.assert_array_equal(times, np.concatenate(expected))
    assert rows.count(axis) == len(times)


def test_target_is_measured_less_simulated(rows: Rows) -> None:
    parts = [run.axes["lift"].torque - run.axes["lift"].base for run in rows.runs]
    picked = [part[chosen(run, "lift")] for part, run in zip(parts, rows.runs, strict=True)]
    np.testing.assert_array_equal(rows.target["lift"], np.concatenate(picked))


@pytest.mark.parametrize("axis", AXES)
def test_a_row_starts_anew_wherever_the_one_before_it_is_not_a_stride_earlier(rows: Rows, axis: str) -> None:
    own = rows.of[axis]
    steps = np.diff(own.sample) == rows.runs[0].stride
    together = steps & (np.diff(own.run) == 0)
    np.testing.assert_array_equal(own.start, np.concatenate(([True], ~together)))


@pytest.mark.parametrize("axis", AXES)
def test_blocks_are_contiguous_and_of_about_equal_length(rows: Rows, axis: str) -> None:
    own = rows.of[axis]
    steps = np.diff(own.block)
    assert own.block[0] == 0
    assert set(np.unique(steps)) <= {0, 1}
    assert not np.any((steps == 0) & (np.diff(own.run) != 0)), "a block never spans two recordings"
    sizes = np.bincount(own.block)
    assert len(sizes) == pytest.approx(Settings().blocks, abs=2)
    assert np.median(sizes) == pytest.approx(len(own) / Settings().blocks, rel=0.1)


def test_an_effect_is_predicted_on_the_rows(rows: Rows) -> None:
    """A constant goes through the filter as it is, where the axis does not stick nearby."""
    cost = rows.cost("turn", TorqueOffset(1.3), rows.simulation.dynamics()["turn"])
    assert set(cost) == {"turn"}
    far = 3 * reach(PERIOD, rows.runs[0].cutoff_hz)
    clear = rows.picked("turn", [(~widen(run.axes["turn"].sticks, far)).astype(np.float64) for run in rows.runs]) > 0.5
    assert 0.5 < clear.mean() < 1.0
    np.testing.assert_allclose(cost["turn"][clear], -1.3, rtol=1e-3)


def test_motion_of_all_recordings_stands_one_after_the_other(rows: Rows) -> None:
    whole = np.concatenate([run.axes["lift"].motion.position for run in rows.runs])
    np.testing.assert_array_equal(rows.motion["lift"].position, whole)


def test_what_is_short_is_searched_whole(rows: Rows) -> None:
    assert rows.searched is rows
    assert rows.part is rows


def samples(rows: Rows) -> int:
    return sum(len(run.recording.time) for run in rows.runs)


def test_of_much_more_than_enough_samples_a_search_decides_on_pieces_of_ten_seconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = compared(tmp_path, strokes(1, 100.0), strokes(2, 25.0, name="short"))
    assert long.searched is long
    monkeypatch.setattr(of_rows, "SEARCHED", samples(long) // 2)
    found = replace(long).searched
    assert samples(found) == pytest.approx(samples(long) / 2, rel=0.05)
    names = [run.recording.name for run in found.runs]
    assert (names.count("strokes"), names.count("short")) == (5, 1)
    lengths = [len(run.recording.time) * run.period for run in found.runs]
    assert lengths == pytest.approx([10.0] * 5 + [12.5], rel=0.01)
    for name, run in (("strokes", long.runs[0]), ("short", long.runs[1])):
        own = [each.recording.time for each in found.runs if each.recording.name == name]
        assert own[0][0] == run.recording.time[0]
        assert own[-1][-1] == run.recording.time[-1] or len(own) == 1


def test_where_an_axis_hardly_moves_in_a_small_part_a_search_begins_on_what_it_decides_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long = compared(tmp_path, strokes(1, 150.0))
    monkeypatch.setattr(of_rows, "SEARCHED", samples(long) // 2)
    assert replace(long).part is not replace(long).searched
    monkeypatch.setattr(of_rows, "_pieces", _still)
    found = replace(long)
    assert found.part is found.searched
    assert samples(found.searched) < samples(long)


def _still(run: Run, share: float, least: int) -> list[Run]:
    """Pieces, of which the small ones have no motion of the lift."""
    found = PIECES_OF(run, share, least)
    none = np.zeros(len(found[0].recording.time), dtype=np.bool_)
    if least == 1:
        return found
    return [replace(one, axes={**one.axes, "lift": one.axes["lift"].counting(none, none)}) for one in found]


def test_what_a_search_decides_on_is_no_less_than_what_it_begins_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    long = compared(tmp_path, strokes(1, 100.0))
    monkeypatch.setattr(of_rows, "SEARCHED", int(20.0 / PERIOD))  # less than the 30 s on which a search begins
    found = replace(long)
    assert found.part is found.searched


def test_a_part_is_pieces_spread_over_a_long_recording(tmp_path: Path) -> None:
    long = compared(tmp_path, strokes(1, 1.2 * MUCH * ENOUGH))
    whole, pieces = long.runs[0], long.part.runs
    assert sum(len(piece.recording.time) for piece in pieces) * PERIOD == pytest.approx(ENOUGH, rel=0.05)
    assert pieces[0].recording.time[0] == whole.recording.time[0]
    assert pieces[-1].recording.time[-1] == whole.recording.time[-1]
    begins = np.array([piece.recording.time[0] for piece in pieces])
    np.testing.assert_allclose(np.diff(begins), np.diff(begins).mean(), rtol=1e-3)
    for piece in pieces:
        begin = round(float(piece.recording.time[0] - whole.recording.time[0]) / PERIOD)
        span = slice(begin, begin + len(piece.recording.time))
        for axis in AXES:
            own, all_of_it = piece.axes[axis], whole.axes[axis]
            np.testing.assert_array_equal(own.torque, all_of_it.torque[span])
            np.testing.assert_array_equal(own.motion.position, all_of_it.motion.position[span])
            assert not own.fitted[0]
            assert not own.fitted[-1]
            assert np.all(all_of_it.fitted[span] | ~own.fitted)


def test_each_recording_has_its_share_of_a_part(tmp_path: Path) -> None:
    long = compared(tmp_path, strokes(1, 140.0, name="1"), strokes(2, 40.0, name="2"))
    lengths = {
        name: sum(len(run.recording.time) for run in long.part.runs if run.recording.name == name) * PERIOD for name in "12"
    }
    assert lengths["1"] / lengths["2"] == pytest.approx(140.0 / 40.0, rel=0.1)
    assert lengths["1"] + lengths["2"] == pytest.approx(ENOUGH, rel=0.1)


COSTS = (
    *(TorqueRipple(0.3, 12.0, 0.4), Coulomb(2.0), Presliding(3000.0, 3.0), Elasticity(3e4, 20.0)),
    *(Backlash(1e-3, 3e4, 5.0), Backlash(1e-3, 1e5, 20.0), Backlash(3e-3, 1e5, 40.0)),
)
BEGINS = 3.0
"""Of a motion [s], in which play still rings from how it began, which few samples do not tell."""


@pytest.mark.parametrize("effect", COSTS, ids=lambda one: one.name)
def test_what_an_effect_costs_is_the_same_on_fewer_samples(effect: AxisEffect, tmp_path: Path) -> None:
    """Of 2,000 samples a second a search keeps 500: within a quarter of what a comparison errs by, or 3 % of what it costs."""
    told = ready(tmp_path, finer(strokes(1, 20.0), 4))
    whole, few = told.runs[0], told.rows.runs[0]
    step = round(few.period / whole.period)
    assert step == 4
    dynamics = told.rows.simulation.dynamics()["turn"]
    expected = whole.cost("turn", effect, dynamics)["turn"][::step]
    apart = expected - few.cost("turn", effect, dynamics)["turn"]
    begins, edge = round(BEGINS / few.period), 2 * reach(few.period, few.cutoff_hz)
    most = max(0.25 * Settings().model_error * rms(whole.axes["turn"].torque), 0.033 * rms(expected[begins:-edge]))
    assert rms(apart[begins:-edge]) < most


def finer(recording: Recording, times: int) -> Recording:
    """So many times the samples, on a spline through those there are."""
    time = np.linspace(0.0, recording.time[-1], times * (len(recording.time) - 1) + 1)
    columns = {
        axis: {name: CubicSpline(recording.time, samples)(time) for name, samples in own.items()}
        for axis, own in recording.columns.items()
    }
    info = recording.info.model_copy(update={"sample_period": recording.info.sample_period / times})
    return replace(recording, info=info, time=time, columns=columns)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
