"""Offsets in time: on loops simulated here the tracking difference vanishes, without them it is what theory says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_axis import CYCLE, INERTIA, LOOPS, Move, follow

from drivetwin.controller.feedforward.alignment import Loops, aligned, aligned_velocity, loop_reaction
from drivetwin.controller.joint_path import JointPath, Rows

NOTHING_HELD = np.zeros(1)


def needed(path: JointPath) -> Rows:
    return INERTIA * path.acceleration


def sent(path: JointPath, torque: Rows) -> Rows:
    """The torque offsets of a path (n,)."""
    return np.asarray(aligned(path, torque, [LOOPS], NOTHING_HELD).torque[:, 0])


def greatest(error: Rows) -> float:
    return float(np.abs(error).max())


def late(column: Rows) -> Rows:
    """As the position demand is: `setpoint_delay` rows later."""
    return np.concatenate([np.zeros(LOOPS.setpoint_delay), column[: -LOOPS.setpoint_delay]])


def test_without_any_offset_the_difference_is_speed_over_position_gain() -> None:
    """The least that the simulation must know: e' = v - Kp e, in a slow move v / Kp - a / Kp²."""
    move = Move(1.0, 3.2)
    path, gain = move.sample(), LOOPS.position_gain
    error = follow(move, np.zeros(move.rows), np.zeros(move.rows))
    theory = late(path.velocity[:, 0]) / gain - late(path.acceleration[:, 0]) / gain**2
    np.testing.assert_allclose(error, theory, atol=0.005 * greatest(error))


def test_torque_alone_leaves_the_lag_over_the_position_gain() -> None:
    """The loop sees v - lag a: in a slow move that fed-forward velocity and exact torque follow it stands lag a / Kp ahead."""
    move = Move(1.0, 3.2)
    path = move.sample()
    error = follow(move, sent(path, needed(path)))
    theory = -LOOPS.velocity_lag * late(path.acceleration[:, 0]) / LOOPS.position_gain
    assert greatest(theory) > 1e-5
    np.testing.assert_allclose(error, theory, atol=0.08 * greatest(theory))


def by_own_speed(move: Move) -> Rows:
    path = move.sample()
    return follow(move, sent(path, needed(path) - loop_reaction(path, [LOOPS])))


def by_velocity_offset(move: Move) -> Rows:
    path = move.sample()
    return follow(move, sent(path, needed(path)), aligned_velocity(path, [LOOPS])[:, 0])


@pytest.mark.parametrize("offsets", [by_own_speed, by_velocity_offset])
def test_with_the_offsets_the_lag_s_difference_vanishes(offsets: object) -> None:
    """By 50 or more: half a servo period (62 us) that the lag of 530 us is off already leaves a ninth of it."""
    assert callable(offsets)
    move = Move(1.0, 0.8)
    path = move.sample()
    uncorrected = greatest(follow(move, sent(path, needed(path))))
    assert greatest(offsets(move)) < uncorrected / 50.0


def test_what_is_left_is_of_third_order() -> None:
    """Twice as slow, the lag's difference falls by 4 as the acceleration does; what is left of it by 8 as the jerk does."""
    slow, quick = Move(1.0, 1.6), Move(1.0, 0.8)
    for move in (slow, quick):
        assert greatest(loop_reaction(move.sample(), [LOOPS])) > 0.0
    plain = [greatest(follow(move, sent(move.sample(), needed(move.sample())))) for move in (quick, slow)]
    corrected = [greatest(by_own_speed(move)) for move in (quick, slow)]
    assert plain[0] / plain[1] == pytest.approx(4.0, rel=0.1)
    assert corrected[0] / corrected[1] > 6.0


def test_the_reaction_is_the_pi_of_what_the_loop_sees_late() -> None:
    """Kv (x + int x / Ti) of x = lag a, integrated numerically."""
    path = Move(0.7, 0.5).sample()
    seen_late = LOOPS.velocity_lag * path.acceleration[:, 0]
    assert LOOPS.integral_time is not None
    held = np.cumsum(seen_late) * CYCLE / LOOPS.integral_time
    np.testing.assert_allclose(loop_reaction(path, [LOOPS])[:, 0], LOOPS.velocity_gain * (seen_late + held), atol=0.02)
    proportional = loop_reaction(path, [replace(LOOPS, integral_time=None)])[:, 0]
    np.testing.assert_allclose(proportional, LOOPS.velocity_gain * seen_late, rtol=1e-12)


@pytest.mark.parametrize(
    ("setpoint_delay", "current_lag", "shares"),
    [
        (1, 0.0005, {20: 1.0}),
        (2, 0.0005, {21: 1.0}),
        (2, 0.00025, {21: 0.75, 22: 0.25}),
        (1, 0.0008, {20: 0.7, 19: 0.3}),
    ],
)
def test_an_impulse_comes_at_its_row(setpoint_delay: int, current_lag: float, shares: dict[int, float]) -> None:
    """Set-point's delay less half a cycle of holding less the current loop's lag, split between two rows by a straight line."""
    path = JointPath(CYCLE, *(np.zeros((40, 1)) for _ in range(3)))
    impulse = np.zeros((40, 1))
    impulse[20] = 1.0
    loops = replace(LOOPS, setpoint_delay=setpoint_delay, current_lag=current_lag)
    expected = np.zeros(40)
    for row, share in shares.items():
        expected[row] = share
    np.testing.assert_allclose(aligned(path, impulse, [loops], NOTHING_HELD).torque[:, 0], expected, atol=1e-12)


def test_an_impulse_of_velocity_comes_as_late_as_the_loop_sees_speed() -> None:
    """2 cycles less half a one, later by 400 us of filter less half a servo period of 200 us: 1.8 cycles."""
    velocity = np.zeros((40, 1))
    velocity[20] = 1.0
    path = JointPath(CYCLE, np.zeros((40, 1)), velocity, np.zeros((40, 1)))
    loops = replace(LOOPS, velocity_lag=0.0004, servo_period=0.0002)
    expected = np.zeros(40)
    expected[21], expected[22] = 0.2, 0.8
    np.testing.assert_allclose(aligned_velocity(path, [loops])[:, 0], expected, atol=1e-12)


def test_what_the_loops_hold_already_is_not_told_again() -> None:
    """Each axis its own."""
    path = JointPath(CYCLE, *(np.zeros((10, 2)) for _ in range(3)))
    torque = np.tile([170.0, 2.0], (10, 1))
    both: list[Loops] = [LOOPS, LOOPS]
    told = aligned(path, torque, both, np.array([169.0, -1.0])).torque
    np.testing.assert_allclose(told, np.tile([1.0, 3.0], (10, 1)))
