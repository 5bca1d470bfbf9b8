"""Patterns put into a gap by hand come out with their share and their word; noise and a friction law show none."""

from __future__ import annotations

import numpy as np
import pytest
from gap_bench import CUTOFF, axis_of, coloured_noise, recording_of, swinging, time_of

from drivetwin.diagnosis.report.patterns import patterns
from drivetwin.diagnosis.report.result import Array, Pattern

NOISE = 0.02
TIME = time_of(60.0)
POSITION, VELOCITY, ACCELERATION = swinging(TIME)
DIRECTION = np.sign(VELOCITY)


def found(gap: Array, simulated: Array | None = None, unit: str = "N·m", seed: int = 0) -> dict[str, Pattern]:
    noise = coloured_noise(np.random.default_rng(seed), len(TIME), NOISE)
    recording = recording_of(TIME, {"rotate": axis_of(TIME, gap + noise, simulated)})
    return {each.over: each for each in patterns([recording], "rotate", NOISE, CUTOFF, unit)}


def beyond_own_motion(column: Array) -> float:
    """Share of a column's energy in motion that no law of direction, speed and acceleration has: polynomials, least squares."""
    moving = axis_of(TIME, column).used
    speed = np.abs(VELOCITY / np.abs(VELOCITY).max()) ** 0.5
    laws = [speed**power * factor for power in range(6) for factor in (np.ones_like(TIME), DIRECTION)]
    own = np.column_stack([*laws, ACCELERATION])[moving]
    rest = column[moving] - own @ np.linalg.lstsq(own, column[moving])[0]
    return float(rest @ rest / (column[moving] @ column[moving]))


def period(detail: str) -> float:
    """The figure in "period 7.2 deg"."""
    word, figure, _unit = detail.split()
    assert word == "period"
    return float(figure)


@pytest.mark.parametrize("seed", range(8))
def test_noise_has_no_pattern(seed: int) -> None:
    assert found(np.zeros_like(TIME), seed=seed) == {}


def test_noise_that_is_louder_than_told_has_no_pattern_either() -> None:
    rng = np.random.default_rng(3)
    assert found(coloured_noise(rng, len(TIME), 10.0 * NOISE)) == {}


def test_a_friction_law_and_an_inertia_are_no_patterns() -> None:
    stribeck = 0.5 * np.exp(-((VELOCITY / 0.2) ** 2)) * DIRECTION
    assert found(0.4 * DIRECTION + 0.2 * VELOCITY + stribeck + 0.3 * ACCELERATION + 0.1) == {}


def test_a_period_over_position_with_its_share() -> None:
    wave = 0.3 * np.sin(2.0 * np.pi * POSITION / 0.125664 + 1.0)
    friction = 0.3 * DIRECTION
    position = found(wave + friction)["position"]
    moving = axis_of(TIME, wave).used
    by_hand = np.mean(wave[moving] ** 2) / np.mean((wave + friction)[moving] ** 2)
    assert position.detail.endswith(" deg")
    assert period(position.detail) == pytest.approx(7.2, rel=0.005)
    assert position.share == pytest.approx(by_hand, abs=0.05)


def test_a_period_of_the_friction_on_a_slide_is_told_in_millimetres() -> None:
    detail = found(0.2 * np.sin(2.0 * np.pi * POSITION / 0.25) * DIRECTION, unit="N")["position"].detail
    assert detail.endswith(" mm")
    assert period(detail) == pytest.approx(250.0, rel=0.01)


def test_a_spring_is_a_curve_over_position() -> None:
    spring = 0.5 * (POSITION - 0.2)
    position = found(spring)["position"]
    assert position.detail.startswith("a curve over 11")
    assert "deg" in position.detail
    assert position.share == pytest.approx(beyond_own_motion(spring), abs=0.05)


def test_friction_under_load() -> None:
    simulated = 1.5 * np.sin(2.0 * POSITION) + 0.5 * ACCELERATION
    friction = 0.15 * np.abs(simulated) * DIRECTION
    load = found(friction, simulated)["load"]
    assert load.detail == "friction grows with |torque|"
    assert load.share == pytest.approx(beyond_own_motion(friction), abs=0.05)


def test_a_torque_constant_goes_with_torque() -> None:
    simulated = 1.5 * np.sin(2.0 * POSITION + 0.5) + 0.5 * ACCELERATION + DIRECTION
    load = found(-0.15 * simulated, simulated)["load"]
    assert load.detail == "falls with torque"
    assert load.share == pytest.approx(beyond_own_motion(simulated), abs=0.05)


def test_friction_that_runs_warm() -> None:
    time = found(0.5 * np.exp(-TIME / 15.0) * DIRECTION)["time"]
    first = np.sqrt(np.mean(np.exp(-2.0 * TIME[TIME < 20.0] / 15.0)))
    last = np.sqrt(np.mean(np.exp(-2.0 * TIME[TIME > 40.0] / 15.0)))
    assert time.detail.startswith("falls by ")
    assert time.detail.endswith(" % in 60 s")
    assert float(time.detail.split()[2]) == pytest.approx(100.0 * (1.0 - last / first), abs=6.0)
    assert time.share > 0.3


def test_a_fan_s_frequency_with_its_share() -> None:
    frequency = found(0.3 * np.sin(2.0 * np.pi * 12.0 * TIME) + 0.3 * DIRECTION)["frequency"]
    assert float(frequency.detail.removesuffix(" Hz")) == pytest.approx(12.0, abs=0.5)
    assert frequency.share == pytest.approx(0.045 / (0.045 + 0.09), abs=0.06)


def test_the_axis_that_pulls() -> None:
    pulled = 0.2 * swinging(TIME, frequency=0.83)[2]
    noise = coloured_noise(np.random.default_rng(9), len(TIME), NOISE)
    axes = {"rotate": axis_of(TIME, pulled + noise), "stretch": axis_of(TIME, noise, frequency=0.83)}
    seen = {each.over: each for each in patterns([recording_of(TIME, axes)], "rotate", NOISE, CUTOFF, "N·m")}
    assert seen["cross_axis"].detail == "with acceleration of stretch"
    assert seen["cross_axis"].share == pytest.approx(beyond_own_motion(pulled), abs=0.05)


def test_recordings_one_after_the_other() -> None:
    """The same period in two recordings, at other rates, is the same period."""
    wave = 0.3 * np.sin(2.0 * np.pi * POSITION / 0.125664)
    axis = axis_of(TIME, wave)
    halved = type(axis)(*(getattr(axis, name)[::2] for name in type(axis).__dataclass_fields__))
    runs = [recording_of(TIME, {"rotate": axis}), recording_of(TIME[::2], {"rotate": halved}, "coarse")]
    assert period(patterns(runs, "rotate", NOISE, CUTOFF, "N·m")[0].detail) == pytest.approx(7.2, rel=0.005)
