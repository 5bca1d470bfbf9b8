"""How far up torque is compared: as far as it tells something, whatever its unit and whatever noise lies over it."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.diagnosis.prepare.cutoff import USUAL, Sensor, chosen_cutoff, motion_cutoff
from drivetwin.diagnosis.report.result import Array
from drivetwin.recording.recording import Recording, RecordingInfo

SECONDS = 20.0


def time_of(rate: float) -> Array:
    return np.arange(round(SECONDS * rate)) / rate


def recorded(torque: Array, position: Array, rate: float) -> Recording:
    axes = {"turn": {"joint": "turn", "torque_resolution": 1e-3, "position_resolution": 1e-8}}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "one", "sample_period": 1.0 / rate, "axes": axes})
    return Recording("one", info, time_of(rate), {"turn": {"position": position, "torque": torque}})


def swinging(rate: float, line: float, amplitude: float, noise: float, seed: int = 0) -> Recording:
    """Slow strokes with friction, white noise, and a line at a frequency [Hz]."""
    time = time_of(rate)
    position = 0.8 * np.sin(2.0 * np.pi * 0.25 * time)
    velocity = 0.4 * np.pi * np.cos(2.0 * np.pi * 0.25 * time)
    torque = 2.0 * np.tanh(velocity / 0.2) + 0.5 * velocity + amplitude * np.sin(2.0 * np.pi * line * time)
    return recorded(torque + noise * np.random.default_rng(seed).standard_normal(len(time)), position, rate)


def test_a_line_at_70_hertz_is_kept() -> None:
    found = chosen_cutoff([swinging(1000.0, 70.0, 0.3, 0.02)])
    assert 70.0 < found < 140.0


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5])
def test_white_noise_is_not(noise: float) -> None:
    assert chosen_cutoff([swinging(1000.0, 70.0, 0.0, noise)]) == USUAL


@pytest.mark.parametrize(("share", "lowest"), [(0.04, USUAL), (0.06, 1.2 * 120.0)])
def test_a_line_is_kept_if_it_has_more_than_5_percent_of_the_power(share: float, lowest: float) -> None:
    """Two lines and nothing else: their power is half the square of their amplitude; a step up is 2^(1/4)."""
    time = time_of(1000.0)
    torque = np.sqrt(1.0 - share) * np.sin(2.0 * np.pi * 5.0 * time) + np.sqrt(share) * np.sin(2.0 * np.pi * 120.0 * time)
    found = chosen_cutoff([recorded(torque, 0.8 * np.sin(2.0 * np.pi * 0.25 * time), 1000.0)])
    assert lowest <= found < 2.0**0.25 * lowest


def test_one_axis_of_one_recording_is_enough() -> None:
    quiet = swinging(1000.0, 70.0, 0.0, 0.02)
    assert chosen_cutoff([quiet, swinging(1000.0, 120.0, 0.3, 0.02), quiet]) > 120.0


def test_a_hum_that_shows_only_where_little_moves_is_none_of_the_motion() -> None:
    """Where little varies, a hum of 0.02 N·m is most of what does; beside the torque of another recording it is nothing."""
    whole, rate = swinging(1000.0, 70.0, 0.0, 0.002), 1000.0
    time = time_of(rate)
    hum = 0.02 * np.sin(2.0 * np.pi * 260.0 * time) + 0.002 * np.random.default_rng(3).standard_normal(len(time))
    calm = recorded(0.5 * np.sin(0.2 * time) + hum, 0.8 * np.sin(0.2 * time), rate)
    assert chosen_cutoff([calm]) > 260.0
    assert chosen_cutoff([whole, calm]) == chosen_cutoff([whole]) == USUAL


def test_it_does_not_depend_on_the_unit_of_the_torque() -> None:
    one = swinging(1000.0, 70.0, 0.3, 0.02)
    scaled = recorded(1000.0 * one.columns["turn"]["torque"], one.columns["turn"]["position"], 1000.0)
    assert chosen_cutoff([one]) == pytest.approx(chosen_cutoff([scaled]))


@pytest.mark.parametrize("rate", [50.0, 100.0])
def test_a_slow_recording_is_compared_up_to_four_tenths_of_its_rate(rate: float) -> None:
    assert chosen_cutoff([swinging(rate, 7.0, 0.3, 0.02)]) == pytest.approx(min(USUAL, 0.4 * rate))


def test_at_5_kilohertz_a_line_at_300_is_kept() -> None:
    assert 300.0 < chosen_cutoff([swinging(5000.0, 300.0, 0.3, 0.02)]) <= 2000.0


@pytest.mark.parametrize("noise", [1e-6, 1e-4])
def test_white_noise_of_a_position_is_told_beneath_a_motion(noise: float) -> None:
    time = time_of(1000.0)
    position = np.sin(time) + noise * np.random.default_rng(1).standard_normal(len(time))
    assert Sensor.of(recorded(0.0 * time, position, 1000.0), "turn", velocity=False).noise == pytest.approx(noise, rel=0.1)


def test_rounding_to_a_quantum_is_noise_of_its_root_of_a_twelfth() -> None:
    time = time_of(1000.0)
    position = np.round(np.sin(3.0 * time) / 1e-4) * 1e-4
    assert Sensor.of(recorded(0.0 * time, position, 1000.0), "turn", velocity=False).noise == pytest.approx(
        1e-4 / np.sqrt(12.0), rel=0.3
    )


def test_a_coarse_position_is_filtered_lower_than_a_fine_one() -> None:
    def at(noise: float) -> float:
        one = swinging(1000.0, 70.0, 0.0, 0.02)
        position = one.columns["turn"]["position"] + noise * np.random.default_rng(2).standard_normal(len(one.time))
        return motion_cutoff([recorded(one.columns["turn"]["torque"], position, 1000.0)], {"turn": 1.0})

    assert at(1e-4) < at(1e-6)
    assert at(1e-4) >= 2.0
