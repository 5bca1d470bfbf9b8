"""Noise of a position without a velocity beside it: inertia and acceleration against the true ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig_bench import TURNING, ready
from test_steadied import error_of, inertia_of, part_of, recorded, velocity

from drivetwin.diagnosis.prepare.prepared import Prepared
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


def test_steps_of_an_encoder_are_noise_too(tmp_path: Path) -> None:
    made = ready(tmp_path, counted(2e-4))
    assert is_smoothed(made)
    assert inertia_of(made) == pytest.approx(TURNING, rel=0.005)
    assert any("differences of its position are more noise than motion" in note for note in made.notes)


def test_a_clean_position_stays_as_it_is(tmp_path: Path) -> None:
    made = ready(tmp_path, recorded(0.0))
    smooth = made.runs[0].recording.columns["turn"]
    np.testing.assert_allclose(smooth.get(SMOOTHED, smooth["position"]), smooth["position"], atol=1e-6)
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
