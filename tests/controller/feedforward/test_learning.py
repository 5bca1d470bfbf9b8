"""The learning on loops simulated here: what repeats is learned, what is not of the torque is not."""

from __future__ import annotations

import numpy as np
import pytest
from linear_axis import CYCLE, INERTIA, LOOPS, Move, follow
from numpy.typing import NDArray
from wafer_handler.learning import FADE, Learner

from drivetwin.controller.joint_path import Rows

MOVE = Move(1.0, 0.4)
LEARNER = Learner(LOOPS, INERTIA, CYCLE)
TIME = np.arange(MOVE.rows, dtype=np.float64) * CYCLE
BUMPS = 0.5 * np.exp(-(((TIME - 0.25) / 0.03) ** 2)) - 0.2 * np.exp(-(((TIME - 0.36) / 0.02) ** 2))
"""A torque of the machine that comes back in every run [N·m]: what no model knows, slow beside the learning's 40 Hz."""


def exact() -> tuple[Rows, Rows]:
    """Torque and velocity offsets (n,) that leave nothing on the undisturbed axis but what rows of 1 ms leave."""
    late = TIME - LOOPS.setpoint_delay * CYCLE
    torque = INERTIA * MOVE.at(late + 0.5 * CYCLE + LOOPS.current_lag, 2)
    velocity = MOVE.at(late + 0.5 * CYCLE + 0.5 * LOOPS.servo_period - LOOPS.velocity_lag, 1)
    return torque, velocity


def repeated(disturbance: Rows, repetitions: int, learner: Learner = LEARNER) -> tuple[list[float], Rows]:
    """Peaks of the tracking difference of the first run and of each repetition, and what was learned."""
    torque, velocity = exact()
    learned, peaks = np.zeros(MOVE.rows), []
    for _ in range(repetitions + 1):
        error = follow(MOVE, torque + learned, velocity, disturbance)
        peaks.append(float(np.abs(error).max()))
        learned = learner.next(learned, error, MOVE.moving())
    return peaks, learned


def test_a_disturbance_that_repeats_is_learned() -> None:
    peaks, learned = repeated(BUMPS, 5)
    assert peaks[0] > 1e-5
    assert peaks[5] < peaks[0] / 10.0
    assert peaks[1] < peaks[0] / 3.0, "an inverse of the loops learns most of it at once"
    _, without = repeated(0.0 * BUMPS, 5)
    before_the_current_loop = np.interp(TIME + LOOPS.current_lag, TIME, BUMPS)
    np.testing.assert_allclose(learned - without, before_the_current_loop, atol=0.02 * float(np.abs(BUMPS).max()))


def test_one_repetition_inverts_the_loops_at_20_hz_too() -> None:
    """By five at once: without the inertia's torque, or three cycles late, it would be by less than three."""
    burst = 0.3 * np.sin(2.0 * np.pi * 20.0 * TIME) * np.exp(-(((TIME - 0.25) / 0.06) ** 2))
    peaks, _ = repeated(burst, 1)
    assert peaks[1] < peaks[0] / 5.0


def test_a_wrong_inertia_slows_the_learning_and_does_not_shake_it() -> None:
    peaks, _ = repeated(BUMPS, 5, Learner(LOOPS, 1.3 * INERTIA, CYCLE))
    assert peaks[5] < peaks[0] / 10.0


def test_what_is_faster_than_the_cutoff_is_left_alone() -> None:
    """At 150 Hz the low-pass, fourth order and twice, passes less than 1e-4."""
    ripple = 1e-4 * np.sin(2.0 * np.pi * 150.0 * TIME) * MOVE.moving()
    slow = 1e-4 * np.sin(2.0 * np.pi * 8.0 * TIME) * MOVE.moving()
    nothing = np.zeros(MOVE.rows)
    middle = slice(150, 350)
    fast_learned = LEARNER.next(nothing, ripple, MOVE.moving())[middle]
    assert float(np.abs(fast_learned).max()) < 0.02 * float(np.abs(LEARNER.next(nothing, slow, MOVE.moving())[middle]).max())


def still() -> NDArray[np.bool_]:
    """Where the demand has stood for `FADE` or more."""
    start, end = TIME[MOVE.moving()][[0, -1]]
    return np.asarray((start - TIME >= FADE + CYCLE) | (TIME - end >= FADE + CYCLE))


def test_at_standstill_nothing_is_learned_and_nothing_is_sent() -> None:
    """Even where the axis stands beside its demand, and where torque was learned in the move before."""
    error = np.full(MOVE.rows, 3e-4) + 1e-4 * np.sin(20.0 * TIME)
    for before in (np.zeros(MOVE.rows), np.ones(MOVE.rows)):
        learned = LEARNER.next(before, error, MOVE.moving())
        assert still().sum() > 200
        np.testing.assert_array_equal(learned[still()], 0.0)
    assert float(np.abs(learned[MOVE.moving()]).max()) > 0.5


def test_an_error_after_the_end_teaches_nothing() -> None:
    """It comes when the demand has stood for the low-pass's reach and `FADE`; the move's own torque stays as it was."""
    error = np.where(TIME > 0.62, 3e-4, 0.0)
    learned = LEARNER.next(np.zeros(MOVE.rows), error, MOVE.moving())
    in_the_move = LEARNER.next(np.zeros(MOVE.rows), np.where(TIME > 0.3, 3e-4, 0.0), MOVE.moving())
    assert float(np.abs(learned).max()) < 1e-3 * float(np.abs(in_the_move).max())


@pytest.mark.parametrize("beside", [3e-4, -3e-4])
def test_an_error_from_before_the_start_is_not_learned(beside: float) -> None:
    """The axis stood beside its demand; once it moves the position loop works it off as exp(-Kp t)."""
    since = np.maximum(TIME - TIME[np.argmax(MOVE.moving())], 0.0)
    error = beside * np.exp(-LOOPS.position_gain * since)
    learned = LEARNER.next(np.zeros(MOVE.rows), error, MOVE.moving())
    taken_for_torque = LOOPS.velocity_gain * LOOPS.position_gain * abs(beside)
    assert float(np.abs(learned).max()) < 1e-6 * taken_for_torque


def test_on_the_loops_most_of_an_error_from_before_the_start_is_not_learned() -> None:
    """The integral part makes more of it than the exponential; less than half of Kv Kp e is taken for a torque."""
    torque, velocity = exact()
    beside = 3e-4
    with_it = follow(MOVE, torque, velocity, beside=beside)
    assert with_it[0] == pytest.approx(beside)
    learned = LEARNER.next(np.zeros(MOVE.rows), with_it, MOVE.moving())
    assert float(np.abs(learned).max()) < 0.5 * LOOPS.velocity_gain * LOOPS.position_gain * beside
