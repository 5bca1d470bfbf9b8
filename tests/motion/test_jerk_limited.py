"""The double S against Ruckig, against the drive's own profile generator, and against the limits and the end it promises."""

from __future__ import annotations

from math import ceil, inf, nan

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.emulator.drive import profile_generator
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import JerkLimited, MotionLimits, jerk_limited

PERIOD = 0.001
ULPS = 1.0 + 1e-12

positions = st.floats(-3.0, 3.0)
limits_of_any_axis = st.builds(
    MotionLimits, speed=st.floats(0.01, 10.0), acceleration=st.floats(0.1, 100.0), jerk=st.floats(1.0, 10_000.0)
)

EVERY_CASE = {
    "all seven segments": (1.0, MotionLimits(1.0, 10.0, 200.0), (True, True)),
    "no constant acceleration": (1.0, MotionLimits(1.0, 100.0, 200.0), (False, True)),
    "no cruise": (0.5, MotionLimits(10.0, 10.0, 200.0), (True, False)),
    "jerk only": (0.001, MotionLimits(10.0, 10.0, 200.0), (False, False)),
}


def by_ruckig(start: float, end: float, limits: MotionLimits) -> ruckig.Trajectory:
    """Ruckig's time-optimal trajectory (Berscheid and Kröger, RSS 2021) from rest to rest."""
    task = ruckig.InputParameter(1)
    task.current_position, task.target_position = [start], [end]
    task.max_velocity, task.max_acceleration, task.max_jerk = [limits.speed], [limits.acceleration], [limits.jerk]
    trajectory = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(task, trajectory) == ruckig.Result.Working
    return trajectory


@pytest.mark.parametrize(("way", "limits", "segments"), EVERY_CASE.values(), ids=EVERY_CASE.keys())
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_case_has_its_segments_and_is_ruckigs_trajectory(
    way: float, limits: MotionLimits, segments: tuple[bool, bool], sign: float
) -> None:
    profile = jerk_limited(0.3, 0.3 + sign * way, limits)
    assert (profile.hold_time > 0.0, profile.cruise_time > 0.0) == segments
    optimal = by_ruckig(0.3, 0.3 + sign * way, limits)
    assert profile.duration == pytest.approx(optimal.duration, abs=1e-9)
    times = np.linspace(0.0, profile.duration, 201)
    expected = np.array([optimal.at_time(time) for time in times])[:, :, 0]
    motion = profile.at(times)
    np.testing.assert_allclose(motion.position, expected[:, 0], atol=1e-9)
    np.testing.assert_allclose(motion.velocity, expected[:, 1], atol=1e-9)
    np.testing.assert_allclose(motion.acceleration, expected[:, 2], atol=1e-7)


@given(start=positions, end=positions, limits=limits_of_any_axis)
@settings(max_examples=300, deadline=None)
def test_no_profile_is_slower_than_ruckigs(start: float, end: float, limits: MotionLimits) -> None:
    if abs(end - start) < 1e-6:  # Ruckig rounds shorter ways
        return
    assert jerk_limited(start, end, limits).duration == pytest.approx(by_ruckig(start, end, limits).duration, abs=1e-9)


@given(start=positions, end=positions, limits=limits_of_any_axis)
@settings(max_examples=150, deadline=None)
def test_it_keeps_its_limits_and_ends_exactly_at_the_target(start: float, end: float, limits: MotionLimits) -> None:
    profile = jerk_limited(start, end, limits)
    motion = profile.sample(PERIOD)
    assert len(motion.position) == ceil(profile.duration / PERIOD)
    if start == end:
        return
    assert (motion.position[-1], motion.velocity[-1], motion.acceleration[-1]) == (end, 0.0, 0.0)
    assert np.abs(motion.velocity).max() <= limits.speed * ULPS
    assert np.abs(motion.acceleration).max() <= limits.acceleration * ULPS
    assert abs(profile.jerk) <= limits.jerk * ULPS
    assert np.all(np.diff(motion.position) * np.sign(end - start) >= -1e-15)
    jerk = np.abs(np.diff(motion.acceleration)) / PERIOD
    rounding = 4.0 * np.finfo(np.float64).eps * profile.duration / PERIOD  # of times that are distinguished
    assert jerk.max(initial=0.0) <= limits.jerk * (ULPS + rounding)


@pytest.mark.parametrize(("way", "limits", "_segments"), EVERY_CASE.values(), ids=EVERY_CASE.keys())
def test_velocity_and_acceleration_are_the_derivatives_of_the_position(
    way: float, limits: MotionLimits, _segments: object
) -> None:
    profile = jerk_limited(-1.0, -1.0 + way, limits)
    step = profile.duration / 10_000
    motion = profile.at(np.arange(10_001, dtype=np.float64) * step)
    velocity = np.diff(motion.position) / step
    acceleration = np.diff(motion.velocity) / step
    # a central difference errs by step²/24 of the third derivative, an average over a kink by step/8 of it
    np.testing.assert_allclose(velocity, 0.5 * (motion.velocity[1:] + motion.velocity[:-1]), atol=limits.jerk * step**2)
    np.testing.assert_allclose(
        acceleration, 0.5 * (motion.acceleration[1:] + motion.acceleration[:-1]), atol=0.25 * limits.jerk * step
    )


@pytest.mark.parametrize(("way", "limits", "_segments"), EVERY_CASE.values(), ids=EVERY_CASE.keys())
def test_a_drive_that_plans_the_same_move_itself_goes_the_same_way(way: float, limits: MotionLimits, _segments: object) -> None:
    profile = jerk_limited(0.1, 0.1 + way, limits)
    bounds = profile_generator.Bounds(limits.speed, limits.acceleration, limits.acceleration, limits.jerk)
    drive = profile_generator.move_to(profile_generator.Motion(0.1, 0.0), 0.1 + way, bounds)
    assert drive.duration == pytest.approx(profile.duration, rel=1e-6)
    times = np.linspace(0.0, profile.duration, 101)
    motion = profile.at(times)
    np.testing.assert_allclose([drive.at(time).position for time in times], motion.position, atol=1e-9 + 1e-6 * way)
    np.testing.assert_allclose([drive.at(time).velocity for time in times], motion.velocity, atol=1e-6 * limits.speed)


@given(start=positions, end=positions, limits=limits_of_any_axis, slower=st.floats(1.0, 20.0))
@settings(max_examples=60, deadline=None)
def test_scaled_to_a_longer_time_it_is_the_same_way_and_gentler(
    start: float, end: float, limits: MotionLimits, slower: float
) -> None:
    profile = jerk_limited(start, end, limits)
    scaled = profile.scaled_to(slower * profile.duration)
    assert scaled.duration == pytest.approx(slower * profile.duration, rel=1e-12)
    u = np.linspace(0.0, 1.0, 101)
    quick, slow = profile.at(u * profile.duration), scaled.at(u * scaled.duration)
    size = abs(end - start)
    np.testing.assert_allclose(slow.position, quick.position, atol=1e-12)
    np.testing.assert_allclose(slow.velocity * slower, quick.velocity, rtol=1e-9, atol=1e-9 * size * limits.speed)
    np.testing.assert_allclose(
        slow.acceleration * slower**2, quick.acceleration, rtol=1e-9, atol=1e-9 * limits.acceleration
    )


def test_the_shortest_way_that_a_float_can_tell_is_a_move() -> None:
    profile = jerk_limited(0.0, 5e-324, MotionLimits(1.0, 10.0, 200.0))
    assert profile.jerk == pytest.approx(200.0)
    assert profile.sample(PERIOD).position.tolist() == [5e-324]


def test_a_move_without_a_way_takes_no_time_and_can_wait() -> None:
    profile = jerk_limited(0.7, 0.7, MotionLimits(1.0, 1.0, 1.0))
    assert profile.duration == 0.0
    assert len(profile.sample(PERIOD).position) == 0
    waiting = profile.scaled_to(0.0035).sample(PERIOD)
    np.testing.assert_array_equal(waiting.position, [0.7, 0.7, 0.7, 0.7])
    np.testing.assert_array_equal(waiting.velocity, np.zeros(4))


def test_it_stands_before_its_start_and_after_its_end() -> None:
    profile = jerk_limited(1.0, 2.0, MotionLimits(1.0, 10.0, 200.0))
    motion = profile.at(np.array([-1.0, 0.0, profile.duration, profile.duration + 1.0]))
    np.testing.assert_array_equal(motion.position, [1.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(motion.velocity, np.zeros(4))
    np.testing.assert_array_equal(motion.acceleration, np.zeros(4))


def test_what_would_break_the_limits_is_refused() -> None:
    profile = JerkLimited(0.0, 1.0, 0.1, 0.1, 0.4)
    with pytest.raises(UserError, match=r"a move of 1 s cannot be scaled to 0.9 s"):
        profile.scaled_to(0.9)
    for wrong in (0.0, -1.0, inf, nan):
        with pytest.raises(UserError, match=r"the jerk limit .* must be positive and finite"):
            MotionLimits(1.0, 1.0, wrong)
