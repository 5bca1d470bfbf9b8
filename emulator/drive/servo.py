"""The drives' loops: position P, velocity PI, current lag, as they run every 125 us, all axes of a machine side by side.

Everything here is on the motor shaft: rad, rad/s, N·m. The cascade is that of CiA 402-2 (IEC 61800-7-201), 'position control
function': velocity demand = position_gain * following error + velocity_feedforward * demand velocity + 60B1h, torque demand =
PI of the velocity error + 60B2h, limited; integration stops while limited.
"""

from __future__ import annotations

from enum import IntEnum
from math import floor, pi

import numpy as np
from numpy.typing import NDArray

from emulator.compiled import compiled

SERVO_PERIOD = 125e-6
"""Speed and position loop of a ServoOne at 8 and 16 kHz switching frequency [s]."""


class Loop(IntEnum):
    """Which loops of an axis are closed."""

    OFF = 0
    TORQUE = 1
    VELOCITY = 2
    POSITION = 3


PARAMETERS = np.dtype(
    [
        ("position_gain", "f8"),  # 1/s
        ("velocity_gain", "f8"),  # N·m·s/rad
        ("integral_rate", "f8"),  # 1/s, inverse of the integral time; 0 is a P loop
        ("velocity_feedforward", "f8"),  # 0..1
        ("velocity_filter", "f8"),  # share of the new value a period
        ("current_filter", "f8"),  # share of the new value a period
        ("torque_limit", "f8"),  # N·m
        ("encoder_quantum", "f8"),  # rad
        ("torque_noise", "f8"),  # N·m rms
        ("torque_quantum", "f8"),  # N·m
    ]
)

STATE = np.dtype(
    [
        ("position", "f8"),  # rad, as counted
        ("velocity", "f8"),  # rad/s, filtered
        ("following_error", "f8"),  # rad
        ("velocity_demand", "f8"),  # rad/s
        ("position_demand", "f8"),  # rad
        ("integral", "f8"),  # N·m
        ("torque_demand", "f8"),  # N·m, what the velocity loop asks
        ("torque", "f8"),  # N·m, what the motor gives
        ("torque_actual", "f8"),  # N·m, as measured
    ]
)

POSITION, VELOCITY, VELOCITY_OFFSET, TORQUE_OFFSET = range(4)
"""Columns of a demand: rad, rad/s (derivative of the position demand, or the target), rad/s (60B1h), N·m (60B2h)."""


def filter_share(time_constant: float) -> float:
    """Share of the new value that a first-order lag of `time_constant` [s] takes in one servo period."""
    return 1.0 - float(np.exp(-SERVO_PERIOD / time_constant)) if time_constant > 0.0 else 1.0


@compiled
def servo_period(  # type: ignore[no-untyped-def]  # record arrays have no static type
    parameters, state, loops, demand, noise, motor_position, motor_torque
) -> None:
    """One period of every axis: (n,) records, (n,) loops, demand (n, 4), noise (n,), motor position and torque (n,)."""
    for axis in range(parameters.shape[0]):
        p = parameters[axis]
        s = state[axis]
        counted = floor(motor_position[axis] / p.encoder_quantum) * p.encoder_quantum
        s.velocity += p.velocity_filter * ((counted - s.position) / SERVO_PERIOD - s.velocity)
        s.position = counted
        if loops[axis] == 0:
            s.following_error = 0.0
            s.velocity_demand = 0.0
            s.position_demand = counted
            s.integral = 0.0
            s.torque_demand = 0.0
        else:
            _cascade(p, s, loops[axis], demand[axis])
        s.torque += p.current_filter * (s.torque_demand - s.torque)
        motor_torque[axis] = s.torque
        measured = (s.torque + p.torque_noise * noise[axis]) / p.torque_quantum
        s.torque_actual = floor(measured + 0.5) * p.torque_quantum


@compiled
def _cascade(p, s, loop, demand) -> None:  # type: ignore[no-untyped-def]
    if loop == 1:
        wanted = demand[3]
    else:
        s.velocity_demand = demand[1] + demand[2]
        if loop == 3:
            s.position_demand = demand[0]
            s.following_error = demand[0] - s.position
            s.velocity_demand = p.position_gain * s.following_error + p.velocity_feedforward * demand[1] + demand[2]
        error = s.velocity_demand - s.velocity
        wanted = p.velocity_gain * error + s.integral + demand[3]
        if abs(wanted) < p.torque_limit:
            s.integral += p.velocity_gain * p.integral_rate * SERVO_PERIOD * error
    s.torque_demand = min(max(wanted, -p.torque_limit), p.torque_limit)


class Servo:
    """The loops of one axis, as its drive sees them: parameters to write, state to read, a demand for each period."""

    def __init__(self, bank: ServoBank, index: int) -> None:
        self.parameters = bank.parameters[index]
        self.state = bank.state[index]
        self._bank = bank
        self._index = index

    @property
    def loop(self) -> Loop:
        """The loops that are closed now."""
        return Loop(int(self._bank.loops[self._index]))

    @loop.setter
    def loop(self, loop: Loop) -> None:
        self._bank.loops[self._index] = loop

    @property
    def demand(self) -> NDArray[np.float64]:
        """Demand of the coming cycle, a view of (periods, 4): position, velocity, velocity offset, torque offset."""
        view: NDArray[np.float64] = self._bank.demand[: self._bank.periods, self._index]
        return view

    @property
    def positions(self) -> NDArray[np.float64]:
        """Counted positions of the last cycle, a view of (periods,) [rad]."""
        view: NDArray[np.float64] = self._bank.trace[: self._bank.periods, self._index]
        return view


class ServoBank:
    """The loops of all axes of a machine, in arrays that the compiled period works on."""

    def __init__(self, axes: int, seed: int) -> None:
        self.periods = 8
        self.parameters = np.zeros(axes, dtype=PARAMETERS)
        self.state = np.zeros(axes, dtype=STATE)
        self.loops = np.zeros(axes, dtype=np.int64)
        self._make_room(self.periods)
        self._random = np.random.default_rng(seed)
        self._noise = np.zeros((0, axes))
        self._next_noise = 0

    def start_cycle(self, periods: int) -> None:
        """Make the demand views `periods` long."""
        if periods > len(self.demand):
            self._make_room(periods)
        self.periods = periods

    def run(self, period: int, motor_position: NDArray[np.float64], motor_torque: NDArray[np.float64]) -> None:
        """Run the loops for one period: read motor positions (n,) [rad], write motor torques (n,) [N·m]."""
        servo_period(
            self.parameters, self.state, self.loops, self.demand[period], self._noise_row(), motor_position, motor_torque
        )
        self.trace[period] = self.state["position"]

    def _make_room(self, periods: int) -> None:
        axes = len(self.parameters)
        self.demand = np.zeros((periods, axes, 4))
        self.trace = np.zeros((periods, axes))

    def _noise_row(self) -> NDArray[np.float64]:
        if self._next_noise == len(self._noise):
            self._noise = self._random.standard_normal((4096, len(self.parameters)))
            self._next_noise = 0
        self._next_noise += 1
        row: NDArray[np.float64] = self._noise[self._next_noise - 1]
        return row


def encoder_quantum(increments_per_revolution: int) -> float:
    """Angle of one encoder increment [rad]."""
    return 2.0 * pi / increments_per_revolution
