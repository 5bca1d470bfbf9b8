"""Trajectories against closed form and against the limits they promise, by finite differences."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivetwin.controller.excitation import SPEED_LEVELS, VALIDATION_LEVELS, excitation, strokes, with_held
from drivetwin.controller.machine import Axis, available_machines, load_machine
from drivetwin.controller.trajectory import exciting, move, side_by_side, stroke

PERIOD = 0.001
ROUNDING = 1.002
"""Finite differences of a sampled path differ from its derivatives by this factor at most here."""

positions = st.floats(-3.0, 3.0)
speeds = st.floats(0.01, 3.0)
accelerations = st.floats(0.2, 30.0)


def derivatives(path: NDArray[np.float64], start: float) -> tuple[NDArray[np.float64], ...]:
    """Speed, acceleration and jerk by differences of a path that begins and ends with a long rest."""
    rested = np.concatenate([np.full(5, start), path, np.full(5, path[-1])])
    speed = np.diff(rested) / PERIOD
    acceleration = np.diff(speed) / PERIOD
    return speed, acceleration, np.diff(acceleration) / PERIOD


@given(start=positions, end=positions, max_speed=speeds, max_acceleration=accelerations)
@settings(max_examples=60, deadline=None)
def test_a_move_keeps_its_limits_and_rests_at_both_ends(
    start: float, end: float, max_speed: float, max_acceleration: float
) -> None:
    path = move(start, end, max_speed, max_acceleration, PERIOD)
    speed, acceleration, _ = derivatives(path, start)
    assert path[-1] == pytest.approx(end, abs=1e-12)
    assert np.abs(speed).max() <= max_speed * ROUNDING + 1e-9
    assert np.abs(acceleration).max() <= max_acceleration * ROUNDING + 1e-6
    assert np.all(np.diff(path) * np.sign(end - start) >= -1e-12)


def test_a_move_is_the_quintic_and_no_slower_than_the_limit_asks() -> None:
    by_speed = move(0.0, 1.0, 0.5, 1000.0, PERIOD)
    assert len(by_speed) == 3750  # 15/8 of distance over speed
    middle = by_speed[1874]
    assert middle == pytest.approx(0.5, abs=1e-12)
    u = np.arange(1, 3751) / 3750
    np.testing.assert_allclose(by_speed, np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], u), atol=1e-12)
    by_acceleration = move(0.0, 1.0, 1000.0, 10.0 / sqrt(3.0), PERIOD)
    assert len(by_acceleration) == 1000


@given(start=positions, length=st.floats(0.01, 5.0), back=st.booleans(), speed=speeds, acceleration=accelerations)
@settings(max_examples=60, deadline=None)
def test_a_stroke_keeps_its_limits_and_rests_at_both_ends(
    start: float, length: float, back: bool, speed: float, acceleration: float
) -> None:
    end = start - length if back else start + length
    path = stroke(start, end, speed, acceleration, PERIOD)
    v, a, jerk = derivatives(path, start)
    assert path[-1] == pytest.approx(end, abs=1e-9)
    assert np.abs(v).max() <= speed * ROUNDING + 1e-9
    assert np.abs(a).max() <= acceleration * ROUNDING + 1e-6
    # acceleration is continuous: raised cosine of height a and length 2 v/a changes by at most pi a^2/(2 v) a second
    reached = min(speed, sqrt(0.5 * length * acceleration))
    assert np.abs(jerk).max() <= 1.05 * pi * acceleration**2 / (2.0 * reached) + 1e-6 / PERIOD


def test_a_stroke_cruises_at_its_speed_for_as_long_as_geometry_says() -> None:
    speed, acceleration, length = 0.4, 4.0, 0.5
    path = stroke(0.0, length, speed, acceleration, PERIOD)
    ramp = 2.0 * speed / acceleration  # each covers speed * ramp / 2
    cruise = (length - speed * ramp) / speed
    at_speed = np.abs(np.diff(path) / PERIOD - speed) < 1e-9
    assert at_speed.sum() == pytest.approx(cruise / PERIOD, abs=3)
    assert len(path) == pytest.approx((2.0 * ramp + cruise) / PERIOD, abs=2)


@given(seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_the_exciting_move_stays_inside_and_excites(seed: int) -> None:
    path = exciting(0.2, (-0.5, 1.0), 2.0, 15.0, 4.0, PERIOD, seed)
    v, a, _ = derivatives(path, 0.2)
    assert -0.5 <= path.min() <= path.max() <= 1.0
    assert np.abs(v).max() <= 2.0
    assert np.abs(a).max() <= 15.0
    assert path[-1] == pytest.approx(0.2, abs=1e-12)
    # regressors of inertia, viscous and Coulomb friction and an offset are distinguishable
    moving = np.abs(v[1:]) > 0.02
    regressors = np.column_stack([a, v[1:], np.sign(v[1:]), np.ones(len(a))])[moving]
    scaled = regressors / np.linalg.norm(regressors, axis=0)
    assert np.linalg.cond(scaled) < 10.0
    np.testing.assert_array_equal(path, exciting(0.2, (-0.5, 1.0), 2.0, 15.0, 4.0, PERIOD, seed))


AXES = {f"{name}-{label}": axis for name in available_machines() for label, axis in load_machine(name).axes.items()}


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES.keys())
def test_identification_motion_stays_within_the_machine(axis: Axis) -> None:
    middle = 0.5 * (axis.travel[0] + axis.travel[1])
    for path in (strokes(axis, SPEED_LEVELS, PERIOD), strokes(axis, VALIDATION_LEVELS, PERIOD), excitation(axis, 3, PERIOD)):
        v, a, _ = derivatives(path, middle)
        assert axis.travel[0] - 1e-9 <= path.min() <= path.max() <= axis.travel[1] + 1e-9
        assert np.abs(v).max() <= axis.max_speed * ROUNDING
        assert np.abs(a).max() <= axis.max_acceleration * ROUNDING
        assert path[-1] == pytest.approx(middle, abs=1e-9)


def test_strokes_cruise_at_every_level_both_ways() -> None:
    axis = load_machine("scara").axes["rotate"]
    speed = np.diff(strokes(axis, SPEED_LEVELS, PERIOD)) / PERIOD
    for level in SPEED_LEVELS:
        for direction in (1.0, -1.0):
            assert np.sum(np.abs(speed - direction * level * axis.max_speed) < 1e-6) > 0.2 / PERIOD


def test_axes_side_by_side_wait_at_their_end() -> None:
    both = side_by_side([np.array([1.0, 2.0, 3.0]), np.array([7.0])])
    np.testing.assert_array_equal(both, [[1.0, 7.0], [2.0, 7.0], [3.0, 7.0]])
    held = with_held({"b": np.array([1.0, 2.0])}, {"a": 5.0, "b": 0.0})
    np.testing.assert_array_equal(held, [[5.0, 1.0], [5.0, 2.0]])
