"""One axis of pure inertia behind a drive's loops, written from CiA 402-2's cascade: what the feed-forward is judged on.

It shares no code with the virtual drives or the controller: time is stepped by the servo period, the plant is J q'' = torque,
the demand is the motion itself, `setpoint_delay` cycles late, as a drive that interpolates perfectly has it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from drivetwin.controller.feedforward.alignment import Loops
from drivetwin.controller.joint_path import JointPath, Rows

SERVO, CYCLE = 125e-6, 1e-3
PERIODS = round(CYCLE / SERVO)
FILTER_HZ, CURRENT_LAG = 300.0, 0.0005

INERTIA = 0.17
LOOPS = Loops(
    position_gain=40.0,
    velocity_gain=32.0,
    integral_time=0.02,
    velocity_lag=1.0 / (2.0 * np.pi * FILTER_HZ),
    current_lag=CURRENT_LAG,
    setpoint_delay=2,
    servo_period=SERVO,
)
"""Of the wafer handler's rotate axis."""

SHAPE = Polynomial([0.0] * 5 + [126.0, -420.0, 540.0, -315.0, 70.0])
"""0 to 1 with four derivatives that vanish at both ends."""


@dataclass(frozen=True)
class Move:
    """From 0 to `way` [rad] in `duration` seconds, after `before` and before `after` seconds of standstill."""

    way: float
    duration: float
    before: float = 0.05
    after: float = 0.3

    @property
    def rows(self) -> int:
        """Cycles of all of it."""
        return round((self.before + self.duration + self.after) / CYCLE)

    def at(self, time: Rows, order: int = 0) -> Rows:
        """Position or a derivative of it at times (n,) [s]."""
        u = np.clip((time - self.before) / self.duration, 0.0, 1.0)
        return np.asarray(self.way * SHAPE.deriv(order)(u) / self.duration**order)

    def sample(self) -> JointPath:
        """Rows (n, 1) at 0, CYCLE, ..."""
        time = np.arange(self.rows, dtype=np.float64) * CYCLE
        position, velocity, acceleration = (self.at(time, order)[:, None] for order in range(3))
        return JointPath(CYCLE, position, velocity, acceleration)

    def moving(self) -> NDArray[np.bool_]:
        """At which SYNCs the demand moves (n,)."""
        time = (np.arange(self.rows) - LOOPS.setpoint_delay) * CYCLE
        return np.asarray((time > self.before) & (time < self.before + self.duration))


def follow(
    move: Move, torque: Rows, velocity: Rows | None = None, disturbance: Rows | float = 0.0, beside: float = 0.0
) -> Rows:
    """Demand - counted position (n,) [rad] at each SYNC; torque, velocity offsets and disturbance are (n,), a row a cycle.

    Without velocity offsets the drive feeds its own demand's speed forward. `disturbance` [N·m] opposes the motor. The axis
    starts `beside` its demand [rad], held there until the demand moves.
    """
    time = np.arange(move.rows * PERIODS, dtype=np.float64) * SERVO
    late = time - LOOPS.setpoint_delay * CYCLE
    demand = move.at(late + SERVO)
    fed_forward = move.at(late + SERVO, 1) if velocity is None else np.repeat(velocity, PERIODS)
    offset, opposing = np.repeat(torque, PERIODS), np.repeat(np.broadcast_to(disturbance, move.rows), PERIODS)
    free = late >= move.before
    velocity_share = 1.0 - np.exp(-SERVO * 2.0 * np.pi * FILTER_HZ)
    current_share = 1.0 - np.exp(-SERVO / CURRENT_LAG)
    assert LOOPS.integral_time is not None
    position, speed, counted, seen, integral, motor = -beside, 0.0, -beside, 0.0, 0.0, 0.0
    error = np.empty(len(time))
    for step in range(len(time)):
        seen += velocity_share * ((position - counted) / SERVO - seen)
        counted = position
        error[step] = demand[step] - counted
        missing = LOOPS.position_gain * error[step] + fed_forward[step] - seen
        if free[step]:
            wanted = LOOPS.velocity_gain * missing + integral + offset[step]
            integral += LOOPS.velocity_gain / LOOPS.integral_time * SERVO * missing
            motor += current_share * (wanted - motor)
            speed += SERVO * (motor - opposing[step]) / INERTIA
            position += SERVO * speed
    return np.concatenate([error[:1], error[PERIODS - 1 :: PERIODS][:-1]])
