"""Set-points to demands: SciPy's B-spline, and what a straight line is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from drivetwin.emulator.drive.interpolation import Interpolation
from drivetwin.emulator.drive.interpolator import Interpolator
from drivetwin.emulator.drive.servo import SERVO_PERIOD, Servo, ServoBank

PERIODS = 8
T = PERIODS * SERVO_PERIOD


def stream(setpoints: NDArray[np.float64], kind: Interpolation) -> NDArray[np.float64]:
    """Position and velocity demand of every servo period, (n * PERIODS, 2)."""
    servo = Servo(ServoBank(1, seed=0), 0)
    interpolator = Interpolator(servo)
    interpolator.start_at(float(setpoints[0]))
    rows = []
    for setpoint in setpoints:
        interpolator.follow(float(setpoint), kind, PERIODS)
        servo.fill_demand()
        rows.append(servo.demand[:, :2].copy())
    return np.concatenate(rows)


def points(count: int = 200) -> NDArray[np.float64]:
    return np.cumsum(np.random.default_rng(2).normal(size=count)) + 5.0


def test_linear_is_exact_at_the_points_and_straight_between() -> None:
    setpoints = points()
    demand = stream(setpoints, Interpolation.LINEAR)
    assert np.array_equal(demand[PERIODS - 1 :: PERIODS, 0], setpoints)
    time = T * np.arange(len(setpoints))
    fine = SERVO_PERIOD * np.arange(1, len(demand) - PERIODS + 1)
    assert np.abs(demand[PERIODS:, 0] - np.interp(fine, time, setpoints)).max() < 1e-12
    assert np.abs(demand[PERIODS:, 1] - np.repeat(np.diff(setpoints) / T, PERIODS)).max() < 1e-9


def test_cubic_is_scipys_uniform_b_spline() -> None:
    """With its derivative; a B-spline of degree 3 on simple knots is C2 (de Boor, ch. IX)."""
    setpoints = points()
    demand = stream(setpoints, Interpolation.CUBIC_SPLINE)
    coefficients = np.concatenate([np.full(3, setpoints[0]), setpoints])
    spline = BSpline(T * np.arange(-3, len(coefficients) + 1), coefficients, 3)
    fine = SERVO_PERIOD * np.arange(1, len(demand) + 1)
    fine[-1] -= 1e-15
    assert np.abs(demand[:, 0] - spline(fine)).max() < 1e-10
    assert np.abs(demand[:, 1] - spline.derivative()(fine)).max() * T < 1e-8


def test_cubic_has_no_step_in_the_acceleration() -> None:
    setpoints = points()
    demand = stream(setpoints, Interpolation.CUBIC_SPLINE)
    acceleration = np.gradient(demand[:, 1], SERVO_PERIOD)[1:-1]
    jerk = np.abs(np.diff(np.concatenate([np.full(3, setpoints[0]), setpoints]), 3)).max() / T**3
    assert np.abs(np.diff(acceleration)).max() <= jerk * SERVO_PERIOD * (1.0 + 1e-6)


def test_cubic_misses_the_points_by_a_sixth_of_t_squared_times_acceleration() -> None:
    time = T * np.arange(400)
    setpoints = 3.0 * np.sin(40.0 * time)
    demand = stream(setpoints, Interpolation.CUBIC_SPLINE)
    reached = demand[PERIODS - 1 :: PERIODS, 0]
    off = reached[3:] - setpoints[2:-1]  # a cycle later than the straight line
    acceleration = 3.0 * 40.0**2
    assert np.abs(off).max() <= acceleration * T**2 / 6.0
    assert np.abs(off + setpoints[2:-1] * 40.0**2 * T**2 / 6.0).max() < 0.01 * acceleration * T**2 / 6.0


def test_standing_still_after_start() -> None:
    for kind in Interpolation:
        assert np.ptp(stream(np.full(5, 7.25), kind)[:, 0]) < 1e-12
