"""Shares of the gap by regime, held against motions whose regimes are known by construction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_bench import PERIOD, STANDSTILL, axis_of, recording_of, swinging, time_of
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.diagnosis.report.result import Array, AxisPrediction, Prediction
from drivetwin.diagnosis.report.where import REGIMES, classify, find_bounds, regimes


def shares(predictions: list[Prediction], noise_rms: float = 0.0) -> dict[str, float]:
    return {each.regime: each.share for each in regimes(predictions, "rotate", noise_rms, STANDSTILL)}


def trapezium(time: Array, top: float) -> AxisPrediction:
    """There and back: 1 s at rest, ramp of 0.5 s, 3 s steady, ramp down, 1 s at rest, and the same backwards; no gap."""
    corners = [0, 1, 1.5, 4.5, 5, 6, 6.5, 9.5, 10, 11]
    velocity = np.interp(time, corners, [0, 0, top, top, 0, 0, -top, -top, 0, 0])
    position = np.cumsum(velocity) * PERIOD
    zero = np.zeros_like(time)
    used = np.abs(velocity) > STANDSTILL
    return AxisPrediction(zero, zero, zero, used, position, velocity, np.gradient(velocity, PERIOD))


def with_gap(axis: AxisPrediction, gap: Array) -> AxisPrediction:
    return replace(axis, measured=axis.before + gap)


def test_each_regime_is_found_where_it_was_put() -> None:
    time = time_of(11.0)
    axis = trapezium(time, 0.8)
    prediction = recording_of(time, {"rotate": axis})
    bounds = find_bounds([prediction], "rotate")
    # by hand: travel 0.8 * 3.5 = 2.8 rad; ramps of 1.6 rad/s², 2 s of 8 s in motion
    assert bounds.displacement == pytest.approx(0.028, rel=0.01)
    assert bounds.acceleration == pytest.approx(1.6 * np.sqrt(0.25), rel=0.01)
    assert bounds.low_speed == pytest.approx(0.2)
    names = np.array(REGIMES)[classify(axis, time, bounds, STANDSTILL)]
    # 1.1 s: 0.8 * 0.1² = 0.008 rad from where it stood
    assert list(names[np.rint(np.array([1.1, 1.4, 3.0, 4.8]) / PERIOD).astype(int)]) == [
        "presliding",
        "acceleration",
        "high_speed",
        "acceleration",
    ]
    assert "reversal" not in names[axis.used], "it stood for a second between forwards and backwards"


def test_a_turn_without_a_stop_is_a_reversal() -> None:
    time = time_of(20.0)
    axis = axis_of(time, np.zeros_like(time))
    bounds = find_bounds([recording_of(time, {"rotate": axis})], "rotate")
    regime = np.array(REGIMES)[classify(axis, time, bounds, STANDSTILL)]
    _, velocity, _ = swinging(time)
    crossings = time[1:][velocity[1:] * velocity[:-1] < 0.0]
    distance = np.abs(time[:, None] - crossings).min(axis=1)
    assert np.all(regime[distance < 0.047] == "reversal")
    assert not np.any(regime[distance > 0.053] == "reversal")


@pytest.mark.parametrize("regime", REGIMES)
def test_a_gap_in_one_regime_only_has_its_whole_share(regime: str) -> None:
    time = time_of(60.0)
    axis = axis_of(time, np.zeros_like(time))
    bounds = find_bounds([recording_of(time, {"rotate": axis})], "rotate")
    here = np.array(REGIMES)[classify(axis, time, bounds, STANDSTILL)] == regime
    assert here[axis.used].sum() > 100
    gap = np.where(here, 0.5, 0.0)
    assert shares([recording_of(time, {"rotate": with_gap(axis, gap)})])[regime] == pytest.approx(1.0)


def test_shares_are_energies_with_the_noise_taken_off() -> None:
    time = time_of(11.0)
    axis = trapezium(time, 0.8)
    steady = np.abs(np.abs(axis.velocity) - 0.8) < 1e-9
    gap = np.where(steady, 0.5, 0.3)
    # 6 s steady with 0.25 - 0.04, the ramps' 2 s with 0.09 - 0.04
    found = shares([recording_of(time, {"rotate": with_gap(axis, gap)})], noise_rms=0.2)
    assert found["high_speed"] == pytest.approx(6 * 0.21 / (6 * 0.21 + 2 * 0.05), rel=0.01)
    assert found["presliding"] + found["acceleration"] == pytest.approx(1.0 - found["high_speed"])


def test_no_gap_is_shared_out_like_the_time() -> None:
    time = time_of(11.0)
    found = shares([recording_of(time, {"rotate": trapezium(time, 0.8)})], noise_rms=0.1)
    assert found["high_speed"] == pytest.approx(6.0 / 8.0, rel=0.01)
    assert sum(found.values()) == pytest.approx(1.0, abs=1e-15)


def test_recordings_weigh_by_their_duration() -> None:
    """Every second sample of a recording says the same as all of them."""
    time = time_of(60.0)
    gap = np.where(time < 30.0, 0.2, 0.4)
    axis = axis_of(time, gap)
    halved = AxisPrediction(*(getattr(axis, name)[::2] for name in AxisPrediction.__dataclass_fields__))
    coarse = recording_of(time[::2], {"rotate": halved}, "coarse")
    other = recording_of(time, {"rotate": axis_of(time, 0.1 * np.sin(time), frequency=0.4)}, "other")
    fine = shares([recording_of(time, {"rotate": axis}), other])
    assert shares([coarse, other]) == pytest.approx(fine, abs=5e-3)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), noise_rms=st.floats(0.0, 2.0), scale=st.floats(0.0, 3.0))
def test_shares_are_never_negative_and_add_up_to_one(seed: int, noise_rms: float, scale: float) -> None:
    time = time_of(4.0)
    gap = scale * np.random.default_rng(seed).standard_normal(len(time))
    found = regimes([recording_of(time, {"rotate": axis_of(time, gap, frequency=0.7)})], "rotate", noise_rms, STANDSTILL)
    assert [each.regime for each in found] == list(REGIMES)
    assert all(each.share >= 0.0 for each in found)
    assert abs(sum(each.share for each in found) - 1.0) < 1e-14
