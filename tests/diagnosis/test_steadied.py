"""Where a drive's own velocity is steadier than differences of a position, the motion is read from it: against the true one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import CUTOFF, PERIOD, TURNING, as_modelled, moved, ready, recording, written_model
from scipy.signal import lfilter

from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.recording.recording import Recording

SECONDS = 20.0


def recorded(position_noise: float, **turn: Array) -> Recording:
    """The machine as modelled, the column's position with white noise [rad], and more columns of it."""
    both = moved(3, SECONDS)
    rng = np.random.default_rng(5)
    seen = {axis: at.position for axis, at in both.items()}
    seen["turn"] = seen["turn"] + position_noise * rng.standard_normal(len(seen["turn"]))
    whole = recording(as_modelled(both), seen, noise=1.0)
    return replace(whole, columns={**whole.columns, "turn": {**whole.columns["turn"], **turn}})


def velocity(late: float = 0.0, noise: float = 1e-3) -> Array:
    """The true one, `late` [s], with white noise [rad/s]."""
    at = moved(3, SECONDS)["turn"]
    rng = np.random.default_rng(6)
    return np.asarray(np.interp(at.time - late, at.time, at.velocity) + noise * rng.standard_normal(len(at.time)))


def inertia_of(prepared: Prepared) -> float:
    """Of the column by least squares on its motion as prepared, with friction: the slope that noise in a regressor flattens."""
    own = prepared.runs[0].axes["turn"]
    used, moves = own.fitted, own.motion
    columns = np.column_stack((moves.acceleration, np.sign(moves.velocity), moves.velocity))[used]
    return float(np.linalg.lstsq(columns, moves.torque[used], rcond=None)[0][0])


def read_from_velocity(prepared: Prepared) -> bool:
    return any("read from the recorded velocity" in note for note in prepared.notes)


@pytest.mark.parametrize("late", [0.0, 0.005])
def test_a_noisy_position_is_steadied_by_the_velocity_and_the_inertia_is_right(tmp_path: Path, late: float) -> None:
    assert inertia_of(ready(tmp_path, recorded(3e-4))) < 0.98 * TURNING
    steady = ready(tmp_path, recorded(3e-4, velocity=velocity(late)))
    assert read_from_velocity(steady)
    assert inertia_of(steady) == pytest.approx(TURNING, rel=0.01)


def test_recordings_of_one_name_keep_their_own_motion(tmp_path: Path) -> None:
    """A fitted and a held recording may have the same name."""
    whole = recorded(3e-4, velocity=velocity())
    half = replace(
        whole,
        time=whole.time[: len(whole.time) // 2],
        columns={axis: {k: v[: len(v) // 2] for k, v in own.items()} for axis, own in whole.columns.items()},
    )
    both = prepared(written_model(tmp_path), [whole], [half], Settings(cutoff_hz=CUTOFF))
    assert read_from_velocity(both)
    assert [len(run.recording.time) for run in (*both.runs, *both.checks)] == [len(whole.time), len(half.time)]


def test_a_velocity_through_a_low_pass_of_first_order_does_not_replace_a_fine_position(tmp_path: Path) -> None:
    """Its square is as large as what it has in common with the motion: it looks free of noise, and the position noisy."""
    share = 1.0 - np.exp(-PERIOD / 0.008)
    slow = lfilter([share], [1.0, share - 1.0], velocity(noise=0.0))
    assert not read_from_velocity(ready(tmp_path, recorded(0.0, velocity=np.asarray(slow))))


@pytest.mark.parametrize("scale", [0.9, 2.0 * np.pi, -1.0])
def test_a_velocity_of_another_scale_is_not_that_of_the_position(tmp_path: Path, scale: float) -> None:
    assert not read_from_velocity(ready(tmp_path, recorded(3e-4, velocity=scale * velocity())))


def test_a_position_beside_a_second_encoder_stays_as_counted(tmp_path: Path) -> None:
    both = recorded(3e-4, velocity=velocity())
    joint = {"joint_position": both.columns["turn"]["position"]}
    both = replace(both, columns={**both.columns, "turn": {**both.columns["turn"], **joint}})
    assert not read_from_velocity(ready(tmp_path, both))
