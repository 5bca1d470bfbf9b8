"""Where a drive's own velocity is steadier than differences of a position, the motion is read from it: against the true one."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import CUTOFF, PERIOD, TURNING, as_modelled, moved, ready, recording, written_model
from scipy.signal import lfilter

from drivetwin.diagnosis.prepare.prepared import Prepared, prepared
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.axis_motion import STEADIED
from drivetwin.motion.filtering import zero_phase
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


def part_of(whole: Recording, samples: slice) -> Recording:
    """Some samples of a recording, in steps as equal."""
    columns = {axis: {name: values[samples] for name, values in own.items()} for axis, own in whole.columns.items()}
    time = whole.time[samples]
    info = whole.info.model_copy(update={"sample_period": float(time[1] - time[0])})
    return replace(whole, info=info, time=time, columns=columns)


def inertia_of(prepared: Prepared) -> float:
    """Of the column by least squares on its motion as prepared, with friction: the slope that noise in a regressor flattens."""
    own = prepared.runs[0].axes["turn"]
    used, moves = own.fitted, own.motion
    columns = np.column_stack((moves.acceleration, np.sign(moves.velocity), moves.velocity))[used]
    return float(np.linalg.lstsq(columns, moves.torque[used], rcond=None)[0][0])


def error_of(prepared: Prepared) -> float:
    """Of the acceleration in the compared band, a share of the true one."""
    found = prepared.runs[0].axes["turn"].motion.acceleration
    true = zero_phase(moved(3, SECONDS)["turn"].acceleration, PERIOD, CUTOFF)
    off = zero_phase(found, PERIOD, CUTOFF) - true
    return float(np.std(off[100:-100]) / np.std(true[100:-100]))


def read_from_velocity(prepared: Prepared) -> bool:
    return any("read from the recorded velocity" in note for note in prepared.notes)


@pytest.mark.parametrize("scale", [0.985, 1.0, 1.015])
@pytest.mark.parametrize("late", [0.0, 0.005])
def test_a_noisy_position_is_steadied_by_the_velocity_and_the_inertia_is_right(
    tmp_path: Path, late: float, scale: float
) -> None:
    """A smoothed position errs by 3.6 % in the acceleration; a velocity at 5 ms by 12 %, if it were taken as it comes."""
    smoothed = ready(tmp_path, recorded(3e-4))
    steady = ready(tmp_path, recorded(3e-4, velocity=scale * velocity(late)))
    assert read_from_velocity(steady)
    assert inertia_of(steady) == pytest.approx(TURNING, rel=0.003)
    assert error_of(steady) < 0.4 * error_of(smoothed)


def test_the_loops_keep_the_position_that_they_have_seen(tmp_path: Path) -> None:
    whole = recorded(3e-4, velocity=velocity())
    (run,) = ready(tmp_path, whole).runs
    np.testing.assert_array_equal(run.recording.columns["turn"]["position"], whole.columns["turn"]["position"])
    assert STEADIED in run.recording.columns["turn"]


def test_an_axis_at_rest_does_not_seem_to_move_by_noise_of_its_velocity(tmp_path: Path) -> None:
    """Five times the noise that the velocity leaves in the compared band, which is white."""
    loud = 0.02
    whole = ready(tmp_path, recorded(3e-3, velocity=velocity(noise=loud)))
    assert read_from_velocity(whole)
    assert whole.standstill["turn"] == pytest.approx(5.0 * loud * np.sqrt(2.0 * CUTOFF * PERIOD), rel=0.3)


def test_recordings_of_one_name_keep_their_own_motion(tmp_path: Path) -> None:
    """A fitted and a held recording may have the same name."""
    whole = recorded(3e-4, velocity=velocity())
    half = part_of(whole, slice(0, 5000))
    both = prepared(written_model(tmp_path), [whole], [half], Settings(cutoff_hz=CUTOFF))
    assert read_from_velocity(both)
    assert [len(run.recording.time) for run in (*both.runs, *both.checks)] == [len(whole.time), 5000]


@pytest.mark.parametrize("count", [2, 12, 60])
def test_a_recording_of_some_samples_does_not_vote(tmp_path: Path, count: int) -> None:
    whole = recorded(3e-4, velocity=velocity())
    both = prepared(
        written_model(tmp_path), [whole, replace(part_of(whole, slice(1000, 1000 + count)), name="short")], [whole],
        Settings(cutoff_hz=CUTOFF),
    )  # fmt: skip
    assert read_from_velocity(both)


def test_a_velocity_is_as_late_as_at_its_own_rate(tmp_path: Path) -> None:
    """Differences of a position are half a sample late: 1 ms at 500 rows a second, 5 ms at 100."""
    whole = recorded(3e-4)
    at = moved(3, SECONDS)["turn"]
    fast = recorded(3e-4, velocity=np.diff(at.position, prepend=at.position[0]) / PERIOD)
    slow = part_of(whole, slice(None, None, 5))
    position = at.position[::5]
    differences = np.diff(position, prepend=position[0]) / (5.0 * PERIOD)
    slow = replace(slow, name="slow", columns={**slow.columns, "turn": {**slow.columns["turn"], "velocity": differences}})
    model = written_model(tmp_path)
    both = prepared(model, [fast, slow], [fast], Settings(cutoff_hz=20.0))
    assert read_from_velocity(both)
    for run in both.runs:
        step = 5 if run.recording.name == "slow" else 1
        off = run.recording.columns["turn"][STEADIED] - at.position[::step]
        assert np.std(off[50:-50]) < 1e-4, "the counted position has as much below 1 Hz"


def test_a_velocity_through_a_low_pass_of_first_order_does_not_replace_a_fine_position(tmp_path: Path) -> None:
    """Its square is as large as what it has in common with the motion: it looks free of noise, and the position noisy."""
    share = 1.0 - np.exp(-PERIOD / 0.008)
    slow = lfilter([share], [1.0, share - 1.0], velocity(noise=0.0))
    assert not read_from_velocity(ready(tmp_path, recorded(0.0, velocity=np.asarray(slow))))


@pytest.mark.parametrize("scale", [0.9, 1.03, 2.0 * np.pi, -1.0])
def test_a_velocity_of_another_scale_is_not_that_of_the_position(tmp_path: Path, scale: float) -> None:
    assert not read_from_velocity(ready(tmp_path, recorded(3e-4, velocity=scale * velocity())))


def test_a_position_beside_a_second_encoder_stays_as_counted(tmp_path: Path) -> None:
    both = recorded(3e-4, velocity=velocity())
    joint = {"joint_position": both.columns["turn"]["position"]}
    both = replace(both, columns={**both.columns, "turn": {**both.columns["turn"], **joint}})
    assert not read_from_velocity(ready(tmp_path, both))


def test_a_noise_above_the_torque_is_told_without_an_exponent(tmp_path: Path) -> None:
    """A servo's position was recorded so coarsely that its noise was 2.8 times the torque: 280 %, not 2.8e+02 %."""
    found = ready(tmp_path, recorded(1e-3, velocity=velocity()))
    (note,) = [one for one in found.notes if "read from the recorded velocity" in one]
    told = re.search(r"makes (\d+) % of the torque", note)
    assert told is not None, note
    assert float(told[1]) > 100.0
