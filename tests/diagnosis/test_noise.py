"""What no model can explain: white noise of a known level, a known resolution, through the filter's known bandwidth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import CARRIAGE, CUTOFF, GRAVITY, PERIOD, RESOLUTION, moved, ready, recording

from drivetwin.diagnosis.prepare import noise as of_noise
from drivetwin.diagnosis.prepare.noise import TIMING, Noise, noise_of
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.filtering import zero_phase

SECONDS = 60.0
TIME = np.arange(round(SECONDS / PERIOD), dtype=np.float64) * PERIOD
SHARE = float(2.0 * CUTOFF * PERIOD * 0.875 * (np.pi / 8.0) / np.sin(np.pi / 8.0))
"""Of white noise's power that passes: integral of 1 / (1 + x^8)^2, Butterworth of 4th order twice, over half the rate."""
SETTINGS = Settings()
SLOW = 9.0
"""Above every swing of these torques [Hz]."""


def run_of(folder: Path, torque: Array, noise: float) -> Run:
    """Both axes move; what the column's drive is said to have given is `torque`, and noise of so many quanta."""
    both = moved(1, len(torque) * PERIOD)
    torques = {"turn": torque, "lift": np.zeros(len(torque))}
    return ready(folder, recording(torques, {axis: at.position for axis, at in both.items()}, seed=4, noise=noise)).runs[0]


def told_of(*runs: Run, apart: float = 0.0) -> Noise:
    """Where a model explains the torque but for its noise."""
    return noise_of("turn", runs, [noise_in(run) for run in runs], SETTINGS, apart)


def noise_in(run: Run) -> Array:
    """The torque through the filter less what of it is slow."""
    torque = run.axes["turn"].torque
    slow = np.fft.rfft(torque)
    slow[np.fft.rfftfreq(len(torque), PERIOD) > SLOW] = 0.0
    return np.asarray(torque - np.fft.irfft(slow, len(torque)))


def test_white_noise_comes_out_at_its_level_in_the_band(tmp_path: Path) -> None:
    run = run_of(tmp_path, 0.0 * TIME, noise=25.0)
    assert told_of(run).rms == pytest.approx(25.0 * RESOLUTION["turn"] * np.sqrt(SHARE), rel=0.05)
    raw = run.recording.columns["turn"]["torque"]
    assert told_of(run).rms == pytest.approx(float(np.std(zero_phase(raw, PERIOD, CUTOFF))), rel=0.05)


def test_a_swinging_torque_below_the_cut_off_is_no_noise(tmp_path: Path) -> None:
    slow = 3.0 * np.sin(2.0 * np.pi * 7.0 * TIME)
    told, plain = (told_of(run_of(tmp_path, torque, noise=25.0)).rms for torque in (slow, 0.0 * slow))
    assert told == pytest.approx(plain, rel=0.02)


def test_a_torque_that_never_changes_has_the_noise_of_its_resolution(tmp_path: Path) -> None:
    told = told_of(run_of(tmp_path, 0.0 * TIME, noise=0.0))
    assert told.rms == pytest.approx(RESOLUTION["turn"] / np.sqrt(12.0) * np.sqrt(SHARE), rel=0.05)
    assert told.floor == told.rms
    assert told.model_error == 0.0


def test_what_is_left_evenly_over_the_band_is_noise_and_a_line_in_it_is_none(tmp_path: Path) -> None:
    """Of a torque without noise of its own: what is left is white noise through the filter, and a swing at 11 Hz."""
    run = run_of(tmp_path, 0.0 * TIME, noise=0.0)
    white = zero_phase(0.3 * np.random.default_rng(2).standard_normal(len(TIME)), PERIOD, CUTOFF)
    lines = 2.0 * np.sin(2.0 * np.pi * 11.0 * TIME)
    plain, lined = (noise_of("turn", [run], [left], SETTINGS, 0.0).rms for left in (white, white + lines))
    assert plain == pytest.approx(float(np.std(white)), rel=0.25)
    assert lined == pytest.approx(plain, rel=0.25)


def test_recordings_are_weighed_by_how_long_they_are(tmp_path: Path) -> None:
    quiet, loud = run_of(tmp_path, 0.0 * TIME, 10.0), run_of(tmp_path, 0.0 * TIME[: len(TIME) // 3], 40.0)
    expected = np.sqrt((0.75 * 10.0**2 + 0.25 * 40.0**2) * SHARE) * RESOLUTION["turn"]
    assert told_of(quiet, loud).rms == pytest.approx(expected, rel=0.05)


def test_the_time_by_which_torque_and_position_differ_counts_where_the_torque_changes(tmp_path: Path) -> None:
    """Of a torque that swings: a closed form."""
    run = run_of(tmp_path, 3.0 * np.sin(2.0 * np.pi * 7.0 * TIME), noise=0.0)
    slope = 3.0 * 2.0 * np.pi * 7.0 / np.sqrt(2.0)
    assert told_of(run, apart=0.05 * PERIOD).rms == pytest.approx(slope * 0.05 * PERIOD, rel=0.05)
    assert told_of(run, apart=5.0 * PERIOD).rms == pytest.approx(slope * TIMING * PERIOD, rel=0.05), "more is no noise"


def test_what_a_model_misses_is_a_share_of_the_torque_and_stands_apart(tmp_path: Path) -> None:
    run = run_of(tmp_path, 3.0 * np.sin(2.0 * np.pi * 7.0 * TIME), noise=5.0)
    told = told_of(run)
    used = run.axes["turn"].torque[run.axes["turn"].used]
    assert told.model_error == pytest.approx(SETTINGS.model_error * float(np.sqrt(np.mean(used**2))))
    assert told.floor == pytest.approx(float(np.hypot(told.rms, told.model_error)))


def test_the_weight_that_an_axis_holds_makes_no_share_of_that(tmp_path: Path) -> None:
    """A carriage of 20 N whose motion costs 3 N: by the position that is measured, its weight is exact."""
    moving = 3.0 * np.sin(2.0 * np.pi * 7.0 * TIME)
    both = moved(1, SECONDS)
    torques = {"turn": moving, "lift": CARRIAGE * GRAVITY + moving}
    run = ready(tmp_path, recording(torques, {axis: at.position for axis, at in both.items()}, noise=0.0)).runs[0]
    quiet = [noise_of(axis, [run], [np.zeros(len(moving))], SETTINGS, 0.0) for axis in ("turn", "lift")]
    assert quiet[1].model_error == pytest.approx(quiet[0].model_error, rel=0.02)


def test_a_torque_that_steps_is_no_noise(tmp_path: Path) -> None:
    """As friction's does where an axis turns round: its spectrum goes on above every cut-off."""
    steps = 3.0 * np.sign(np.sin(2.0 * np.pi * 7.0 * TIME))
    run = run_of(tmp_path, steps, noise=5.0)
    white = run.recording.columns["turn"]["torque"] - steps
    told = noise_of("turn", [run], [zero_phase(white, PERIOD, CUTOFF)], SETTINGS, 0.0)
    assert told.rms == pytest.approx(float(np.std(zero_phase(white, PERIOD, CUTOFF))), rel=0.25)


def test_of_many_strokes_both_ways_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is left is three times as loud one way as the other: a floor of every second stroke would be of one way."""
    run = run_of(tmp_path, 0.0 * TIME, noise=25.0)
    strokes = np.arange(len(TIME)) // (len(TIME) // 150)
    left = zero_phase(np.random.default_rng(5).standard_normal(len(TIME)), PERIOD, CUTOFF) * np.where(strokes % 2, 3.0, 1.0)
    left[np.diff(strokes, prepend=-1) > 0] = np.nan

    def floor() -> float:
        return noise_of("turn", [run], [left], SETTINGS, 0.0).rms

    of_some = floor()
    monkeypatch.setattr(of_noise, "STRETCHES", 1000)
    assert of_some == pytest.approx(floor(), rel=0.25)
