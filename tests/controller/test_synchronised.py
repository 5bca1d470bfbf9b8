"""Synchronised axes against Ruckig's phase synchronisation, and against the limits of each axis."""

from __future__ import annotations

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.controller.joint_path import axis_stretch, limits_of, slowed
from drivetwin.controller.machine import load_machine
from drivetwin.controller.synchronised import synchronised
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

PERIOD = 0.001
ULPS = 1.0 + 1e-12
SCARA = [limits_of(axis) for axis in load_machine("scara").axes.values()]

poses = st.tuples(st.floats(0.01, 0.34), st.floats(-2.8, 2.8), st.floats(0.13, 1.37))


@given(start=poses, end=poses)
@settings(max_examples=100, deadline=None)
def test_axes_run_in_phase_within_their_limits_and_end_together(start: tuple[float, ...], end: tuple[float, ...]) -> None:
    move = synchronised(start, end, SCARA)
    path = move.sample(PERIOD)
    if np.allclose(start, end, rtol=0.0, atol=1e-12):
        assert len(path.position) == 0
        return
    np.testing.assert_array_equal(path.position[-1], end)
    np.testing.assert_array_equal(path.velocity[-1], np.zeros(3))
    for axis, limits in enumerate(SCARA):
        assert np.abs(path.velocity[:, axis]).max() <= limits.speed * ULPS
        assert np.abs(path.acceleration[:, axis]).max() <= limits.acceleration * ULPS
        alone = jerk_limited(start[axis], end[axis], limits)
        assert move.duration >= alone.duration * (1.0 - 1e-12)
    # in phase: every row is on the straight line between the ends
    way = np.subtract(end, start)
    along = (path.position - start) @ way / (way @ way)
    np.testing.assert_allclose(path.position, start + np.outer(along, way), atol=1e-12)


@given(way=st.tuples(st.floats(0.1, 1.0), st.floats(-0.9, 0.9), st.floats(-0.9, 0.9)))
@settings(max_examples=60, deadline=None)
def test_where_one_axis_rules_it_is_ruckigs_phase_synchronisation(way: tuple[float, ...]) -> None:
    # Limits in proportion: the first axis is the slowest in speed, acceleration and jerk, if its way is the longest.
    way = (way[0], way[1] * way[0], way[2] * way[0])
    task = ruckig.InputParameter(3)
    task.synchronization = ruckig.Synchronization.Phase
    task.target_position = list(way)
    task.max_velocity, task.max_acceleration, task.max_jerk = [0.8] * 3, [6.0] * 3, [150.0] * 3
    optimal = ruckig.Trajectory(3)
    assert ruckig.Ruckig(3).calculate(task, optimal) == ruckig.Result.Working
    move = synchronised((0.0, 0.0, 0.0), way, [MotionLimits(0.8, 6.0, 150.0)] * 3)
    assert move.duration == pytest.approx(optimal.duration, abs=1e-9)
    assert move.duration == pytest.approx(jerk_limited(0.0, way[0], MotionLimits(0.8, 6.0, 150.0)).duration, abs=1e-12)
    path = move.sample(PERIOD)
    for row in range(0, len(path.position) - 1, 50):
        position, velocity, acceleration = optimal.at_time((row + 1) * PERIOD)
        np.testing.assert_allclose(path.position[row], position, atol=1e-9)
        np.testing.assert_allclose(path.velocity[row], velocity, atol=1e-8)
        np.testing.assert_allclose(path.acceleration[row], acceleration, atol=1e-6)


def test_an_axis_that_stays_does_not_hold_the_others_up() -> None:
    move = synchronised((0.1, 0.5, 0.3), (0.1, 1.5, 0.3), SCARA)
    assert move.duration == pytest.approx(jerk_limited(0.5, 1.5, SCARA[1]).duration, rel=1e-12)
    path = move.sample(PERIOD)
    np.testing.assert_allclose(path.position[:, [0, 2]], np.tile([0.1, 0.3], (len(path.position), 1)), atol=1e-15)
    np.testing.assert_array_equal(path.velocity[:, [0, 2]], np.zeros((len(path.position), 2)))


def test_a_move_is_slowed_until_tighter_limits_hold_and_no_further() -> None:
    move = synchronised((0.1, -1.0, 0.3), (0.3, 1.0, 1.2), SCARA)
    tight = [MotionLimits(0.5 * limits.speed, 0.1 * limits.acceleration, limits.jerk) for limits in SCARA]
    gentle = slowed(move, PERIOD, lambda path: axis_stretch(path, tight))
    assert gentle.sample(PERIOD).position[-1].tolist() == [0.3, 1.0, 1.2]
    used = axis_stretch(gentle.sample(PERIOD), tight)
    assert 0.999 <= used <= 1.0
    assert slowed(gentle, PERIOD, lambda path: axis_stretch(path, tight)) is gentle


def test_axes_that_do_not_match_are_refused() -> None:
    with pytest.raises(UserError, match=r"start, end and limits of the same axes; it got 2, 3 and 3"):
        synchronised((0.0, 0.0), (1.0, 1.0, 1.0), SCARA)
