"""Settling and deceleration time against closed forms, and a leg's time zero against the drive's own position demand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from streaming_bench import streaming
from wafer_handler.leg import leg
from wafer_handler.metrics import BAND, Tracking, tracking

from drivetwin.motion.jerk_limited import MotionLimits

PERIOD, CRUISE_START, CRUISE_END = 1e-3, 0.1, 0.5
TIME = np.arange(900, dtype=np.float64) * PERIOD
CRUISING = TIME < CRUISE_END
PEAK = 2e-3


def tracked(error: np.ndarray) -> Tracking:
    return Tracking(TIME, error, CRUISE_START, CRUISE_END)


def falling(start: float, time_constant: float) -> np.ndarray:
    """An exponential from the start of the move [as `start`]."""
    return np.asarray(start * np.exp(-TIME / time_constant))


@pytest.mark.parametrize("cruise_value", [0.0, 0.3 * PEAK, -40.0 * PEAK])
@pytest.mark.parametrize(("start", "time_constant"), [(PEAK, 0.03), (-PEAK, 0.02), (0.2 * PEAK, 0.03)])
def test_settling_ends_where_the_exponential_enters_the_band(cruise_value: float, start: float, time_constant: float) -> None:
    """|A| exp(-t / T) = band at t = T ln(|A| / band), whatever the value around which it settles; seen at the next sample."""
    error = np.where(CRUISING, cruise_value + falling(start, time_constant), 0.0)
    closed_form = time_constant * np.log(abs(start) / (BAND * PEAK))
    assert closed_form <= tracked(error).settling_time(PEAK) <= closed_form + PERIOD


def test_the_band_is_five_per_cent_of_the_baseline_s_peak() -> None:
    for share, settled in ((0.049, True), (0.051, False)):
        error = np.where(CRUISING & (TIME < 0.2), share * PEAK, 0.0)
        assert (tracked(error).settling_time(PEAK) == 0.0) is settled
    twice = np.where(CRUISING & (TIME < 0.2), 0.051 * PEAK, 0.0)
    assert tracked(twice).settling_time(2.0 * PEAK) == 0.0


def test_leaving_the_band_again_is_not_settled() -> None:
    error = falling(PEAK, 0.02)
    error[300] = -PEAK
    assert tracked(error).settling_time(PEAK) == pytest.approx(0.301)
    assert tracked(error).deceleration_time(PEAK) == 0.0


def test_what_never_settles_takes_for_ever() -> None:
    ringing = PEAK * np.cos(2.0 * np.pi * 50.0 * TIME)
    assert tracked(ringing).settling_time(PEAK) == np.inf
    assert tracked(ringing).deceleration_time(PEAK) == np.inf


@pytest.mark.parametrize("time_constant", [0.01, 0.05])
def test_deceleration_counts_from_its_start_and_around_zero(time_constant: float) -> None:
    braking = 0.4 * PEAK * np.exp(-(TIME - CRUISE_END) / time_constant)
    error = np.where(CRUISING, 0.4 * PEAK, braking)
    closed_form = time_constant * np.log(0.4 / BAND)
    assert closed_form <= tracked(error).deceleration_time(PEAK) + 1e-12 <= closed_form + PERIOD + 1e-12
    assert tracked(error).settling_time(PEAK) == 0.0


def test_the_peak_is_the_greatest_difference_of_either_sign() -> None:
    assert tracked(np.where(TIME == 0.2, -3.0, 1.0)).peak == 3.0


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_time_zero_is_where_the_drive_s_own_demand_starts(profile: str, tmp_path: Path) -> None:
    """The demand in the servo's own state moves at the row of time 0, or within a cycle of it (a spline rounds the corner)."""
    with streaming("stage", profile, (), tmp_path / "bus.log") as bench:
        session, period = bench.session, bench.session.cycle.period
        drive, servo = session.drives[0], bench.virtual.drives[0].axis.servo
        move = leg(np.array([session.machine.axes["slide"].rest]), 0, 0.05, MotionLimits(0.2, 2.0, 1e4))
        log = session.cycle._link.log
        demands: list[float] = []

        def watch(message: object) -> None:
            if getattr(message, "arbitration_id", None) == 0x80:
                demands.append(float(servo.state["position_demand"]))

        session.cycle._link.log = watch
        recording = session.run("x", move.sample(period).position)
        session.cycle._link.log = log
        found = tracking(recording, "slide", move, drive.setpoint_delay)
    starts = int(np.flatnonzero(np.abs(np.array(demands) - demands[0]) > 0.0)[0])
    zero = len(recording.time) - len(found.time)
    assert abs(starts - zero) <= 1
    assert found.time[0] == 0.0
    cruise = (found.time >= found.cruise_start + period) & (found.time < found.cruise_end - period)
    speed = np.gradient(recording.columns["slide"]["position_demand"], period)[zero:]
    np.testing.assert_allclose(speed[cruise], 0.2, rtol=1e-3)
    assert found.cruise_end - found.cruise_start == pytest.approx(0.05 / 0.2 - move.profile.ramp_time)
    assert speed[found.time >= found.cruise_end + 0.01].max() < 0.2 * 0.99
