"""What is held back where nobody gave recordings to validate on: a quarter of every motion, and every axis moves in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import MODEL

from drivetwin.diagnosis.prepare.hold_back import QUARTERS
from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.foundation.errors import UserError
from drivetwin.motion.filtering import reach
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo

PERIOD = 0.004
TREMBLE = 1e-5
"""Of an axis that holds its place [rad]: its encoder and its loop never stand quite still."""


def recorded(name: str, lift: float, turn: float, frequency: float, seconds: float = 10.0) -> Recording:
    """Both axes, swinging so far."""
    return moved(name, lift, turn, lambda time: np.sin(2.0 * np.pi * frequency * time), seconds)


def moved(name: str, lift: float, turn: float, motion: Callable[[Array], Array], seconds: float = 10.0) -> Recording:
    time = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    swing = motion(time)
    columns = {axis: {"position": way * swing, "torque": swing} for axis, way in (("turn", turn), ("lift", lift))}
    axes = {axis: AxisInfo(joint=axis, position_resolution=1e-7) for axis in columns}
    return Recording(name, RecordingInfo(machine="two", sample_period=PERIOD, axes=axes), time, columns)


SETTINGS = Settings(cutoff_hz=48.0)


def split(folder: Path, *recordings: Recording) -> Prepared:
    """What is fitted of these recordings, and what is not."""
    model = folder / "model.xml"
    model.write_text(MODEL, encoding="utf-8")
    return prepared(model, list(recordings), [], SETTINGS)


def travels(part: Sequence[Run], axis: str) -> float:
    """The longest way of an axis in the samples of a recording that count."""
    return max(float(np.ptp(run.axes[axis].motion.position[run.axes[axis].used])) for run in part if run.axes[axis].used.any())


def test_a_quarter_of_each_recording_is_held_back_and_nothing_near_it_is_fitted(tmp_path: Path) -> None:
    found = split(tmp_path, *(recorded(f"run_{k}", 0.3, 1.0, 0.3 + 0.05 * k) for k in range(2)))
    for run, check in zip(found.runs, found.checks, strict=True):
        held, fitted = check.axes["turn"].used, run.axes["turn"].fitted
        moving = held | run.axes["turn"].used
        assert not (held & run.axes["turn"].used).any()
        assert held.sum() == pytest.approx(0.25 * moving.sum(), rel=0.1)
        apart = np.abs(np.flatnonzero(held)[:, None] - np.flatnonzero(fitted)[None, :]).min()
        assert apart > reach(PERIOD, found.cutoff_hz)


def test_of_a_gap_that_comes_and_goes_a_quarter_is_held_back(tmp_path: Path) -> None:
    """Of eight stretches, six have it in one quarter and two in another: two turns would hold back none of it, and one most."""
    seconds, stretches = 32.0, 8
    whole = recorded("bursts", 0.3, 1.0, 0.5, seconds)
    number = np.minimum((whole.time / seconds * 4 * stretches).astype(int), 4 * stretches - 1)
    begun = np.array(QUARTERS)[number // 4 % 4]
    later = np.where(number // 4 < 2, 1, 2)
    bursts = np.where(number % 4 == (begun + later) % 4, np.sin(2.0 * np.pi * 1.3 * whole.time), 0.0)
    columns = {axis: {**own, "torque": own["torque"] + 20.0 * bursts} for axis, own in whole.columns.items()}
    found = split(tmp_path, replace(whole, columns=columns))
    (run,), (check,) = found.runs, found.checks
    for axis in ("turn", "lift"):
        held, fitted = (float(np.sum((own.torque - own.base)[own.used] ** 2)) for own in (check.axes[axis], run.axes[axis]))
        assert 0.15 < held / (held + fitted) < 0.4, axis


def test_a_gap_of_one_recording_is_held_back_as_much_as_that_of_another(tmp_path: Path) -> None:
    """By any one quarter of all: of the first recording two hold back none, of the second one holds back most."""
    seconds = 32.0
    number = np.minimum((np.arange(round(seconds / PERIOD)) * PERIOD / seconds * 32).astype(int), 31)
    begun = np.array(QUARTERS)[number // 4 % 4]
    first = number % 4 == (begun + np.where(number // 4 < 2, 1, 2)) % 4
    second = number % 4 == (begun + np.where(number // 4 < 2, 1, 3)) % 4
    several = []
    for name, there in (("first", first), ("second", second)):
        whole = recorded(name, 0.3, 1.0, 0.5, seconds)
        more = 20.0 * there * np.sin(2.0 * np.pi * 1.3 * whole.time)
        several.append(
            replace(whole, columns={axis: {**own, "torque": own["torque"] + more} for axis, own in whole.columns.items()})
        )
    found = split(tmp_path, *several)
    for run, check in zip(found.runs, found.checks, strict=True):
        held, fitted = (float(np.sum((own.torque - own.base)[own.used] ** 2)) for own in (check.axes["turn"], run.axes["turn"]))
        assert 0.15 < held / (held + fitted) < 0.4, run.recording.name


def test_what_is_held_back_of_a_sweep_is_like_the_whole(tmp_path: Path) -> None:
    """Its last quarter alone has a tenth of the speed's energy: the amplitude falls with the square of the frequency."""

    def sweep(time: Array) -> Array:
        frequency = 0.3 * (10.0 / 0.3) ** (time / time[-1])
        return np.asarray(np.sin(2.0 * np.pi * np.cumsum(frequency) * PERIOD) / frequency**2)

    found = split(tmp_path, moved("sweep", 0.03, 0.1, sweep, 20.0))
    (run,), (check,) = found.runs, found.checks
    energy = run.axes["turn"].motion.velocity ** 2
    held = check.axes["turn"].used
    whole = float(np.mean(energy[held | run.axes["turn"].used]))
    assert np.mean(energy[-len(energy) // 4 :]) < 0.1 * whole
    assert 0.5 * whole < np.mean(energy[held]) < 2.0 * whole


def test_motion_that_repeats_is_held_back_at_every_phase(tmp_path: Path) -> None:
    """A quarter of each of four periods, never the same one."""
    found = split(tmp_path, recorded("four", 0.3, 1.0, 0.4))
    (check,) = found.checks
    phase = (check.recording.time[check.axes["turn"].used] * 0.4) % 1.0
    counts, _ = np.histogram(phase, 8, (0.0, 1.0))
    assert counts.min() > 0.5 * counts.max()


def test_an_axis_that_only_trembles_in_one_recording_moves_in_both_parts(tmp_path: Path) -> None:
    """Each axis recorded by itself, as `identify` does it."""
    alone = [recorded(f"lift_{k}", 0.3, TREMBLE, 0.1 + 0.01 * k) for k in range(2)]
    alone += [recorded(f"turn_{k}", TREMBLE, 1.0, 0.3 + 0.01 * k) for k in range(3)]
    found = split(tmp_path, *alone)
    for part in (found.runs, found.checks):
        assert travels(part, "lift") > 0.2
        assert travels(part, "turn") > 0.5


def test_a_recording_that_is_too_short_for_a_block_is_fitted_whole(tmp_path: Path) -> None:
    found = split(tmp_path, recorded("long", 0.3, 1.0, 0.5), recorded("short", 0.3, 1.0, 2.9, 0.4))
    assert [run.recording.name for run in found.runs] == ["long", "short"]
    assert [run.recording.name for run in found.checks] == ["long"]


def test_of_many_that_are_too_short_one_is_held_back_whole(tmp_path: Path) -> None:
    found = split(tmp_path, *(recorded(f"short_{k}", 0.3, 1.0, 2.8 + 0.1 * k, 0.4) for k in range(4)))
    assert [run.recording.name for run in found.runs] == ["short_0", "short_2", "short_3"]
    assert [run.recording.name for run in found.checks] == ["short_1"]


def test_of_few_that_are_too_short_nothing_can_be_held_back(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="short: too short to hold a quarter back for validation"):
        split(tmp_path, recorded("short", 0.3, 1.0, 2.9, 0.4))


def test_of_a_short_recording_there_is_one_block(tmp_path: Path) -> None:
    found = split(tmp_path, recorded("short", 0.3, 1.0, 2.9, 1.2))
    (check,) = found.checks
    edges = np.diff(np.concatenate([[0], check.axes["turn"].used.astype(int), [0]]))
    assert 0.15 < check.axes["turn"].used.sum() * PERIOD < 0.31
    assert np.ptp(np.flatnonzero(edges)) * PERIOD < 0.31


@pytest.mark.parametrize("begin", [0.2, 3.85, 10.0, 14.8])
def test_an_axis_that_moves_for_a_moment_does_so_in_both_parts(begin: float, tmp_path: Path) -> None:
    """Of a minute the lift moves for 3 s, which may fall between two blocks, or into one."""

    def once(time: Array) -> Array:
        moving = (time >= begin) & (time < begin + 3.0)
        return np.where(moving, 1.0 - np.cos(2.0 * np.pi * (time - begin)), 0.0)

    lift = moved("minute", 0.1, 0.0, once, 60.0).columns["lift"]
    minute = recorded("minute", 0.0, 1.0, 0.4, 60.0)
    found = split(tmp_path, replace(minute, columns={**minute.columns, "lift": lift}))
    for part in (found.runs, found.checks):
        assert sum(run.axes["lift"].used.sum() for run in part) * PERIOD > 0.2


def test_short_recordings_beside_a_long_one_are_held_back_too(tmp_path: Path) -> None:
    short = [recorded(f"lift_{k}", 0.3, 0.0, 2.5 + 0.1 * k, 0.4) for k in range(6)]
    found = split(tmp_path, recorded("turn", 0.0, 1.0, 0.5), *short)
    for part in (found.runs, found.checks):
        assert travels(part, "lift") > 0.2
        assert travels(part, "turn") > 0.5


def test_a_gap_counts_and_is_fitted_up_to_a_reversal(tmp_path: Path) -> None:
    """Friction that gives way before it slides shows there and hardly anywhere else."""
    found = split(tmp_path, recorded("run", 0.3, 1.0, 0.4))
    run = found.runs[0].axes["turn"]
    turns = np.flatnonzero(np.diff(np.sign(run.motion.velocity)) != 0.0)
    away = np.abs(np.arange(len(run.used))[:, None] - turns).min(axis=1) * PERIOD
    assert max(away[run.used].min(), away[run.fitted].min()) < 0.005
