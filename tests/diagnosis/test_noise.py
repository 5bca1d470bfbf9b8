"""What no model can explain: white noise of a known level, a known resolution, through the filter's known bandwidth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig_bench import CUTOFF, PERIOD, RESOLUTION, compared, moved, recording, strokes

from diagnosis.prepare.motion import Run
from diagnosis.prepare.noise import MODEL_FLOOR, TIMING, WEIGHT_FLOOR, noise_of
from diagnosis.report.result import Array
from drivetwin.motion.filtering import zero_phase

COUNT = 60_000
SHARE = float(2.0 * CUTOFF * PERIOD * 0.875 * (np.pi / 8.0) / np.sin(np.pi / 8.0))
"""Of white noise's power that passes: integral of 1 / (1 + x^8)^2, Butterworth of 4th order twice, over half the rate."""


def standing(folder: Path, torque: Array, noise: float) -> Run:
    """Both axes at rest; the column's torque is given."""
    torques = {"turn": torque, "lift": np.zeros(len(torque))}
    still = {axis: np.zeros(len(torque)) for axis in torques}
    return compared(folder, recording(torques, still, seed=4, noise=noise)).runs[0]


def test_white_noise_comes_out_at_its_level_in_the_band(tmp_path: Path) -> None:
    run = standing(tmp_path, np.zeros(COUNT), noise=25.0)
    told = noise_of("turn", [run]).rms
    assert told == pytest.approx(25.0 * RESOLUTION["turn"] * np.sqrt(SHARE), rel=0.05)
    raw = run.recording.columns["turn"]["torque"]
    assert told == pytest.approx(float(np.std(zero_phase(raw, PERIOD, CUTOFF))), rel=0.05)


def test_a_swinging_torque_below_the_cut_off_is_no_noise(tmp_path: Path) -> None:
    slow = 3.0 * np.sin(2.0 * np.pi * 7.0 * np.arange(COUNT) * PERIOD)
    told, plain = (noise_of("turn", [standing(tmp_path, torque, noise=25.0)]).rms for torque in (slow, 0.0 * slow))
    assert told == pytest.approx(plain, rel=0.02)


def test_a_torque_that_never_changes_has_the_noise_of_its_resolution(tmp_path: Path) -> None:
    told = noise_of("turn", [standing(tmp_path, np.zeros(COUNT), noise=0.0)])
    assert told.rms == pytest.approx(RESOLUTION["turn"] / np.sqrt(12.0) * np.sqrt(SHARE), rel=0.05)
    assert told.floor == told.rms


def test_recordings_are_weighed_by_how_long_they_are(tmp_path: Path) -> None:
    quiet, loud = standing(tmp_path, np.zeros(COUNT), 10.0), standing(tmp_path, np.zeros(COUNT // 3), 40.0)
    expected = np.sqrt((0.75 * 10.0**2 + 0.25 * 40.0**2) * SHARE) * RESOLUTION["turn"]
    assert noise_of("turn", [quiet, loud]).rms == pytest.approx(expected, rel=0.05)


def test_the_moment_of_a_sample_counts_where_an_axis_moves(tmp_path: Path) -> None:
    """A tenth of a sample of a torque that swings: a closed form."""
    both = moved(1, 20.0)
    swings = {axis: 3.0 * np.sin(2.0 * np.pi * 7.0 * at.time) for axis, at in both.items()}
    run = compared(tmp_path, recording(swings, {axis: at.position for axis, at in both.items()}, noise=0.0)).runs[0]
    slope = 3.0 * 2.0 * np.pi * 7.0 / np.sqrt(2.0)
    assert noise_of("turn", [run]).rms == pytest.approx(slope * TIMING * PERIOD, rel=0.05)


def test_the_floor_has_the_comparisons_own_errors(tmp_path: Path) -> None:
    run = compared(tmp_path, strokes(1, 20.0)).runs[0]
    told = noise_of("lift", [run])
    used = run.axes["lift"].torque[run.axes["lift"].used]
    own = float(np.hypot(MODEL_FLOOR * used.std(), WEIGHT_FLOOR * used.mean()))
    assert told.floor == pytest.approx(float(np.hypot(told.rms, own)))
