"""Profiles against their closed forms: time, peak speed, acceleration, jerk, and an end that is exact."""

from __future__ import annotations

from dataclasses import astuple
from itertools import pairwise
from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.emulator.drive.profile_generator import Bounds, Motion, Profile, change_speed, come_to_rest, move_to
from drivetwin.emulator.drive.servo import SERVO_PERIOD


def sampled(profile: Profile, seconds: float) -> np.ndarray:
    """Position and velocity a servo period (n, 2)."""
    demand = np.zeros((round(seconds / SERVO_PERIOD), 4))
    profile.sample(demand)
    return demand[:, :2]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("way", "up", "down"), [(10.0, 50.0, 50.0), (10.0, 80.0, 20.0), (0.3, 50.0, 25.0)])
def test_trapezoid_takes_the_time_of_the_closed_form(sign: float, way: float, up: float, down: float) -> None:
    """t = v/2 (1/a + 1/d) + s/v with a cruise, else a triangle of peak sqrt(2 s a d / (a + d))."""
    speed = 5.0
    peak = min(speed, sqrt(2.0 * way * up * down / (up + down)))
    cruise = (way - 0.5 * peak * peak * (1.0 / up + 1.0 / down)) / peak
    profile = move_to(Motion(1.0, 0.0), 1.0 + sign * way, Bounds(speed, up, down))
    assert profile.duration == pytest.approx(peak / up + cruise + peak / down, rel=1e-9)
    rows = sampled(profile, profile.duration + 0.01)
    assert np.abs(rows[:, 1]).max() == pytest.approx(peak, rel=2e-2 if way < 1.0 else 1e-9)
    assert tuple(rows[-1]) == (1.0 + sign * way, 0.0)


@pytest.mark.parametrize(
    ("way", "speed", "acceleration", "jerk", "time"),
    [
        (10.0, 5.0, 50.0, 1000.0, 10.0 / 5.0 + 5.0 / 50.0 + 50.0 / 1000.0),  # all seven segments
        (10.0, 5.0, 500.0, 1000.0, 10.0 / 5.0 + 2.0 * sqrt(5.0 / 1000.0)),  # acceleration not reached
        (0.02, 50.0, 500.0, 1000.0, 4.0 * (0.02 / 2.0 / 1000.0) ** (1.0 / 3.0)),  # neither speed nor acceleration reached
    ],
)
def test_seven_segments_take_the_time_of_the_closed_form(
    way: float, speed: float, acceleration: float, jerk: float, time: float
) -> None:
    """Biagiotti and Melchiorri 2008, 3.4: s/v + v/a + a/j; s/v + 2 sqrt(v/j); 4 cbrt(s / 2j)."""
    profile = move_to(Motion(0.0, 0.0), way, Bounds(speed, acceleration, acceleration, jerk))
    assert profile.duration == pytest.approx(time, rel=1e-6)
    times = np.linspace(0.0, profile.duration, 4001)
    states = [profile.at(instant) for instant in times]
    accelerations = np.array([state.acceleration for state in states])
    jerks = np.diff(accelerations) / np.diff(times)
    assert np.abs(accelerations).max() <= acceleration * (1.0 + 1e-9)
    assert np.abs(jerks).max() <= jerk * (1.0 + 1e-6)
    assert np.abs(jerks).max() == pytest.approx(jerk, rel=1e-6)
    assert max(state.velocity for state in states) <= speed * (1.0 + 1e-9)
    assert profile.at(profile.duration).position == way


def test_peak_acceleration_is_the_bound_where_there_is_room() -> None:
    profile = move_to(Motion(0.0, 0.0), 10.0, Bounds(5.0, 50.0, 25.0, 1000.0))
    accelerations = [profile.at(time).acceleration for time in np.linspace(0.0, profile.duration, 2001)]
    assert max(accelerations) == pytest.approx(50.0)
    assert min(accelerations) == pytest.approx(-25.0)


finite = st.floats(-50.0, 50.0)


@settings(max_examples=300, deadline=None)
@given(
    finite, finite, finite, st.floats(0.1, 100.0), st.floats(1.0, 1e4), st.floats(1.0, 1e4), st.floats(10.0, 1e6) | st.just(inf)
)
def test_from_any_motion_to_any_target(
    target: float, velocity: float, acceleration: float, speed: float, up: float, down: float, jerk: float
) -> None:
    """Ends at rest at the target; position and velocity never jump; acceleration and jerk within the bounds."""
    start = Motion(0.0, velocity, 0.0 if jerk == inf else acceleration)
    profile = move_to(start, target, Bounds(speed, up, down, jerk))
    times = np.linspace(0.0, profile.duration, 801)
    states = [profile.at(time) for time in times]
    step = profile.duration / 800.0
    most = max(up, down, abs(acceleration)) + 1e-9
    fastest = max(abs(state.velocity) for state in states)
    limit = max(speed, abs(velocity) + (acceleration**2 / (2.0 * jerk) if jerk < inf else 0.0))
    assert fastest <= limit * (1.0 + 1e-6) + 1e-9
    assert max(abs(state.acceleration) for state in states) <= most * (1.0 + 1e-6)
    for before, after in pairwise(states):
        assert abs(after.velocity - before.velocity) <= most * step * (1.0 + 1e-6) + 1e-6
        assert abs(after.position - before.position) <= (fastest + most * step) * step + 1e-6
    assert states[-1].position == target


def test_change_of_speed_and_rest() -> None:
    bounds = Bounds(100.0, 20.0, 40.0)
    rising = change_speed(Motion(0.0, 2.0), 6.0, bounds)
    assert rising.at(0.2).velocity == pytest.approx(6.0)
    assert rising.at(1.2).position == pytest.approx(0.8 + 6.0)
    resting = come_to_rest(Motion(3.0, -4.0), bounds)
    assert resting.duration == pytest.approx(0.1)
    assert astuple(resting.at(1.0)) == pytest.approx(astuple(Motion(3.0 - 0.2, 0.0)))


@pytest.mark.parametrize(("before", "after"), [(50.0, 0.0), (50.0, 1e-6), (-20.0, 30.0), (0.0, 40.0)])
def test_a_change_of_speed_takes_the_time_of_the_closed_form(before: float, after: float) -> None:
    """By 100 rad/s² down and 200 rad/s² up; through zero in both."""
    reversal = before * after < 0.0
    way = abs(before) / 100.0 + abs(after) / 200.0 if reversal else abs(after - before) / (200.0 if after > before else 100.0)
    profile = change_speed(Motion(0.0, before), after, Bounds(inf, 200.0, 100.0))
    assert profile.at(way).velocity == pytest.approx(after, abs=1e-6)
    assert abs(profile.at(0.9 * way).velocity - after) > 0.5
