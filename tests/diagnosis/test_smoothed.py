"""Noise of a position without a velocity beside it: inertia and acceleration against the true ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import PERIOD, TURNING, Swing, as_modelled, moved, ready, recording, swing
from test_steadied import error_of, inertia_of, part_of, recorded, velocity

from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.propose.nominal import nominal_parameters
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.axis_motion import SMOOTHED
from drivetwin.recording.recording import Recording


def is_smoothed(prepared: Prepared) -> bool:
    return SMOOTHED in prepared.runs[0].recording.columns["turn"]


def counted(quantum: float) -> Recording:
    """The machine as modelled, the column's position in steps [rad]."""
    whole = recorded(0.0)
    steps = np.round(whole.columns["turn"]["position"] / quantum) * quantum
    return replace(whole, columns={**whole.columns, "turn": {**whole.columns["turn"], "position": steps}})


@pytest.mark.parametrize("noise", [3e-5, 1e-4, 3e-4])
def test_the_inertia_is_right_whatever_the_noise_of_the_position(noise: float, tmp_path: Path) -> None:
    """As counted it comes out at 0.71, 0.19 and 0.03 of the true one."""
    made = ready(tmp_path, recorded(noise))
    assert is_smoothed(made)
    assert inertia_of(made) == pytest.approx(TURNING, rel=0.005)
    assert error_of(made) < 0.05


def gentle(seed: int, most: float) -> Recording:
    """The machine as modelled, whose column moves with at most so much acceleration [rad/s²]; noise of 0.3 mrad by `seed`."""
    both = moved(3, 20.0) | {"turn": swing(6, 20.0, 0.8, most)}
    seen = {axis: at.position for axis, at in both.items()}
    seen["turn"] = seen["turn"] + 3e-4 * np.random.default_rng(seed).standard_normal(len(seen["turn"]))
    return recording(as_modelled(both), seen, seed, noise=1.0)


@pytest.mark.parametrize("seed", [1, 2, 5, 21])
def test_no_frequency_passes_as_motion_by_chance(seed: int, tmp_path: Path) -> None:
    """Gentle strokes, in which one such frequency has as much acceleration as the motion."""
    assert inertia_of(ready(tmp_path, gentle(seed, 1.0))) == pytest.approx(TURNING, rel=0.03)


def test_a_recording_in_which_the_axis_stands_has_no_say(tmp_path: Path) -> None:
    """As written where one axis moves at a time."""
    still = moved(4, 20.0)
    still["turn"] = Swing(*(still["turn"].time, *(np.zeros_like(still["turn"].time) for _ in range(3))))
    noise = 3e-4 * np.random.default_rng(9).standard_normal(len(still["turn"].time))
    seen = {"turn": noise, "lift": still["lift"].position}
    made = ready(tmp_path, recorded(3e-4), recording(as_modelled(still), seen, name="lift alone", noise=1.0))
    assert is_smoothed(made)
    assert inertia_of(made) == pytest.approx(TURNING, rel=0.005)


def test_a_smoothed_axis_moves_as_slowly_as_it_then_can_tell(tmp_path: Path) -> None:
    """Noise of 1 mrad over 48 Hz would be 0.5 rad/s, a third of its top speed."""
    made = ready(tmp_path, recorded(1e-3))
    own = made.runs[0].axes["turn"]
    assert made.standstill["turn"] < 0.03 * np.abs(own.motion.velocity).max()


@pytest.mark.parametrize("begin", [0, 2500])
def test_a_second_and_a_half_are_enough(begin: int, tmp_path: Path) -> None:
    """As counted the inertia comes out at 0.03 and 0.006 of the true one."""
    short = part_of(recorded(3e-4), slice(begin, begin + round(1.5 / PERIOD)))
    assert is_smoothed(ready(tmp_path, short, short))


def test_steps_of_an_encoder_are_noise_too(tmp_path: Path) -> None:
    made = ready(tmp_path, counted(2e-4))
    assert is_smoothed(made)
    assert inertia_of(made) == pytest.approx(TURNING, rel=0.005)
    assert any("its position is smoothed" in note for note in made.notes)


def test_a_clean_position_stays_as_it_is(tmp_path: Path) -> None:
    made = ready(tmp_path, recorded(0.0))
    assert not is_smoothed(made)
    assert error_of(made) < 1e-3
    assert made.notes == ()


def test_what_loops_have_seen_and_what_a_second_encoder_is_compared_with_stays(tmp_path: Path) -> None:
    noisy = recorded(1e-4)
    made = ready(tmp_path, noisy)
    np.testing.assert_array_equal(made.runs[0].recording.columns["turn"]["position"], noisy.columns["turn"]["position"])
    second = recorded(1e-4, joint_position=noisy.columns["turn"]["position"])
    assert not is_smoothed(ready(tmp_path, second))


def test_where_the_motion_is_read_from_a_velocity_it_is_not_smoothed_as_well(tmp_path: Path) -> None:
    assert not is_smoothed(ready(tmp_path, recorded(3e-4, velocity=velocity())))


@pytest.mark.parametrize("samples", [2, 40])
def test_a_recording_of_some_samples_does_not_vote(samples: int, tmp_path: Path) -> None:
    noisy = recorded(1e-4)
    made = ready(tmp_path, noisy, part_of(noisy, slice(0, samples)))
    assert is_smoothed(made)
    assert inertia_of(made) == pytest.approx(TURNING, rel=0.005)


def test_a_motion_of_a_tenth_of_the_compared_band_is_thinned_only_as_far_as_that_bears(tmp_path: Path) -> None:
    """Of positions that stay noisy, for a second encoder is compared with them: motion up to 8 Hz, torque up to 48 Hz."""
    both, rng = moved(3, 20.0), np.random.default_rng(5)
    whole = recording(
        as_modelled(both), {axis: at.position + 1e-3 * rng.standard_normal(len(at.time)) for axis, at in both.items()}
    )
    columns = {axis: {**own, "joint_position": both[axis].position} for axis, own in whole.columns.items()}
    made = ready(tmp_path, replace(whole, columns=columns))
    assert made.runs[0].motion_hz < 0.2 * made.cutoff_hz
    assert all(np.isfinite(one.column[axis]).all() for one in nominal_parameters(made.rows, Settings()) for axis in one.column)
