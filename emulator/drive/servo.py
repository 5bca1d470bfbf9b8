"""The drives' loops: position P, velocity PI, current lag, every 125 us, all axes of a machine in parallel.

Everything here is on the motor shaft: rad, rad/s, N·m. The cascade is that of CiA 402-2 (IEC 61800-7-201), 'position control
function': velocity demand = position_gain * following error + velocity_feedforward * demand velocity + 60B1h, torque demand =
PI of the velocity error + 60B2h, limited; integration stops while limited. A drive with one PID loop has `position_stiffness`
and `position_integral` in the place of `position_gain` and `integral_rate`.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum, IntFlag
from math import floor, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.interpolation import COURSE, fill_demands
from drivetwin.foundation.compiled import in_place
from drivetwin.foundation.enums import quick

SERVO_PERIOD = 125e-6
"""Speed and position loop of a ServoOne at 8 and 16 kHz switching frequency [s]."""


@quick
class Loop(IntEnum):
    """Which loops of an axis are closed."""

    OFF = 0
    TORQUE = 1
    VELOCITY = 2
    POSITION = 3


LOOPS = tuple(Loop)
"""By their numbers."""


@quick
class Alarm(IntFlag):
    """What the loops find wrong within a servo period."""

    FOLLOWING_ERROR = 1
    OVERCURRENT = 2
    OVERLOAD = 4
    OVERSPEED = 8


PARAMETERS = np.dtype(
    [
        ("position_gain", "f8"),  # 1/s
        ("velocity_gain", "f8"),  # N·m·s/rad
        ("integral_rate", "f8"),  # 1/s, inverse of the integral time; 0 is a P loop
        ("velocity_feedforward", "f8"),  # 0..1
        ("position_stiffness", "f8"),  # N·m/rad, of the following error; 0 in a cascade
        ("position_integral", "f8"),  # N·m/(rad·s), of the following error; 0 in a cascade
        ("velocity_filter", "f8"),  # share of the new value a period
        ("current_filter", "f8"),  # share of the new value a period
        ("current_limit", "f8"),  # N·m that the power stage gives at most, whatever the drive believes
        ("torque_limit", "f8"),  # N·m, both directions
        ("torque_positive", "f8"),  # N·m, 60E0h
        ("torque_negative", "f8"),  # N·m, 60E1h, as a magnitude
        ("speed_limit", "f8"),  # rad/s, 6080h, where only torque is controlled
        ("encoder_quantum", "f8"),  # rad
        ("torque_noise", "f8"),  # N·m rms
        ("torque_quantum", "f8"),  # N·m
        ("encoder_alive", "f8"),  # 1, or 0: the count stands still
        ("error_limit", "f8"),  # rad
        ("error_timeout", "f8"),  # s
        ("trip_torque", "f8"),  # N·m, beyond it the power stage switches off
        ("overspeed", "f8"),  # rad/s
        ("heating", "f8"),  # 1/(N·m)², inverse square of the torque that the motor bears for ever
        ("thermal_share", "f8"),  # share of the way to the steady heat a period
    ]
)

UNLIMITED = ("current_limit", "torque_positive", "torque_negative", "speed_limit", "error_limit", "trip_torque", "overspeed")
"""Limits that are infinite until someone sets them."""

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
        ("error_time", "f8"),  # s, for how long the following error has been beyond its limit
        ("heat", "f8"),  # I2t, 1: as warm as the rated torque makes it for ever
        ("limited", "i8"),  # 1 while the torque is at a limit
        ("alarms", "i8"),  # bits of Alarm that came up since they were cleared
    ]
)

POSITION, VELOCITY, VELOCITY_OFFSET, TORQUE_OFFSET = range(4)
"""Columns of a demand: rad, rad/s (derivative of the position demand, or the target), rad/s (60B1h), N·m (60B2h)."""


NOISE_ROWS = 4096
"""Of unit noise, that are drawn at once."""


def filter_share(time_constant: float, period: float = SERVO_PERIOD) -> float:
    """Share of the new value that a first-order lag of `time_constant` [s] takes in one servo `period` [s]."""
    return 1.0 - float(np.exp(-period / time_constant)) if time_constant > 0.0 else 1.0


@in_place
def servo_period(  # type: ignore[no-untyped-def]  # record arrays have no static type
    parameters, state, loops, demand, noise, motor_position, motor_torque, length
) -> None:
    """One period of `length` [s] of every axis: (n,) records and loops, demand (n, 4), noise, motor position, torque (n,)."""
    for axis in range(parameters.shape[0]):
        p = parameters[axis]
        s = state[axis]
        counted = s.position
        if p.encoder_alive != 0.0:
            counted = floor(motor_position[axis] / p.encoder_quantum) * p.encoder_quantum
        s.velocity += p.velocity_filter * ((counted - s.position) / length - s.velocity)
        s.position = counted
        if loops[axis] == 0:
            s.following_error = 0.0
            s.velocity_demand = 0.0
            s.position_demand = counted
            s.integral = 0.0
            s.torque_demand = 0.0
            s.limited = 0
        else:
            _cascade(p, s, loops[axis], demand[axis], length)
        s.torque += p.current_filter * (s.torque_demand - s.torque)
        s.torque = min(max(s.torque, -p.current_limit), p.current_limit)
        motor_torque[axis] = s.torque
        measured = (s.torque + p.torque_noise * noise[axis]) / p.torque_quantum
        s.torque_actual = floor(measured + 0.5) * p.torque_quantum
        _watch(p, s, loops[axis], length)


@in_place
def _cascade(p, s, loop, demand, length) -> None:  # type: ignore[no-untyped-def]
    most, least = min(p.torque_limit, p.torque_positive), -min(p.torque_limit, p.torque_negative)
    if loop == 1:
        wanted = demand[3]
        if p.speed_limit < np.inf:
            most = max(least, min(most, p.velocity_gain * (p.speed_limit - s.velocity)))
            least = min(most, max(least, p.velocity_gain * (-p.speed_limit - s.velocity)))
        s.following_error = 0.0
        s.velocity_demand = s.velocity
        s.position_demand = s.position
        s.integral = 0.0
    else:
        s.velocity_demand = demand[1] + demand[2]
        if loop == 3:
            s.position_demand = demand[0]
            s.following_error = demand[0] - s.position
            s.velocity_demand = p.position_gain * s.following_error + p.velocity_feedforward * demand[1] + demand[2]
        error = s.velocity_demand - s.velocity
        wanted = p.velocity_gain * error + s.integral + demand[3]
        wound = p.velocity_gain * p.integral_rate * length * error
        if loop == 3:
            wanted += p.position_stiffness * s.following_error
            wound += p.position_integral * length * s.following_error
        if least < wanted < most:
            s.integral += wound
    s.torque_demand = min(max(wanted, least), most)
    s.limited = 0 if least <= wanted <= most else 1


@in_place
def _watch(p, s, loop, length) -> None:  # type: ignore[no-untyped-def]
    """Following error for longer than its time-out, current trip, I2t, overspeed."""
    if loop == 3 and abs(s.following_error) > p.error_limit:
        s.error_time += length
        if s.error_time > p.error_timeout:
            s.alarms |= 1
    else:
        s.error_time = 0.0
    if abs(s.torque) > p.trip_torque:
        s.alarms |= 2
    s.heat += p.thermal_share * (p.heating * s.torque * s.torque - s.heat)
    if s.heat > 1.0:
        s.alarms |= 4
    if abs(s.velocity) > p.overspeed:
        s.alarms |= 8


class Record:
    """One axis's record of a table whose fields all have eight bytes, by their names, as Python's numbers.

    What asks in every cycle keeps a `cell`: ten times as fast as a field of NumPy's.
    """

    def __init__(self, table: NDArray[Any], index: int) -> None:
        fields: Mapping[str, Any] = table.dtype.fields or {}
        views = {code: table.view(code).data for code in {kind.str[1:] for kind, *_ in fields.values()}}
        first = index * len(fields)
        self._cells: dict[str, memoryview[Any]] = {
            name: views[kind.str[1:]][first + offset // kind.itemsize :] for name, (kind, offset, *_) in fields.items()
        }

    def __getitem__(self, name: str) -> Any:
        return self._cells[name][0]

    def __setitem__(self, name: str, value: Any) -> None:
        self._cells[name][0] = value

    def cell(self, name: str) -> memoryview[Any]:
        """Where the field is: `cell[0]` is its value at any time."""
        return self._cells[name]


class Servo:
    """The loops of one axis, as its drive sees them: parameters to write, state to read, a demand for each period.

    Of the coming cycle, and afterwards of the last one: `demand`, a view of (periods, 4): position, velocity, velocity offset,
    torque offset; `periods`, its servo periods; `interval`, those from a SYNC to the next, the cycle being one of them or all;
    `takes_setpoints`, whether it begins at a SYNC, or runs without any: in between set-points wait. A drive that follows
    set-points writes its `course` instead of the demand.
    """

    demand: NDArray[np.float64]
    periods: int
    interval: int
    takes_setpoints: bool

    def __init__(self, bank: ServoBank, index: int) -> None:
        self.parameters = Record(bank.parameters, index)
        self.state = Record(bank.state, index)
        self.course = Record(bank.courses, index)
        self._bank = bank
        self._index = index
        self._loop, self._brake = bank.loops.data[index:], bank.brakes.data[index:]
        bank.join(index, self)

    def begin(self, bank: ServoBank) -> None:
        """Cycles are from now on as the bank has them."""
        self.demand, self.periods, self.interval = bank.demands[self._index], bank.periods, bank.interval
        self.takes_setpoints = bank.first

    @property
    def loop(self) -> Loop:
        """The loops that are closed now."""
        loop: Loop = LOOPS[self._loop[0]]
        return loop

    @loop.setter
    def loop(self, loop: Loop) -> None:
        self._loop[0] = loop
        self._brake[0] = loop is Loop.OFF

    @property
    def brake(self) -> bool:
        """Whether the holding brake is engaged; setting `loop` engages it where the loops are off and releases it elsewhere."""
        return bool(self._brake[0])

    @brake.setter
    def brake(self, engaged: bool) -> None:
        self._brake[0] = engaged

    def fill_demand(self) -> None:
        """Turn the course into the demand of the coming cycle now, for who adds to it; nothing where there is none."""
        only = slice(self._index, self._index + 1)
        fill_demands(self._bank.courses[only], self._bank.demand[: self.periods, only], self._bank.length)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Counted positions of the last cycle, a view of (periods,) [rad]."""
        view: NDArray[np.float64] = self._bank.trace[: self._bank.periods, self._index]
        return view


class ServoBank:
    """The loops of all axes of a machine, in arrays that the compiled period works on; `brakes` (n,): 1 is engaged."""

    def __init__(self, axes: int, seed: int, length: float = SERVO_PERIOD) -> None:
        """`length` of a servo period [s]."""
        self.length = length
        self._servos: dict[int, Servo] = {}
        self.interval = 0
        self.first = True
        self.parameters = np.zeros(axes, dtype=PARAMETERS)
        self.state = np.zeros(axes, dtype=STATE)
        self.courses = np.zeros(axes, dtype=COURSE)
        self.loops = np.zeros(axes, dtype=np.int64)
        self.brakes = np.ones(axes, dtype=np.bool_)
        self._make_room(8)
        self.start_cycle(8)
        for axis in range(axes):
            self.reset(axis)
        self._random = np.random.default_rng(seed)
        self._noise = np.zeros((0, axes))
        self._next_noise = 0

    def reset(self, axis: int) -> None:
        """Forget everything of an axis, whose loops are off and whose brake is engaged, as without power."""
        for values in (self.parameters, self.state, self.courses, self.loops):
            values[axis] = 0
        self.demand[:, axis] = 0.0
        self.parameters["encoder_alive"][axis] = 1.0
        for unlimited in UNLIMITED:
            self.parameters[unlimited][axis] = np.inf
        self.brakes[axis] = True

    def start_cycle(self, periods: int, interval: int | None = None, first: bool = True) -> None:
        """Make the demand views `periods` long; `interval` is from a SYNC to the next, where that is more than a cycle.

        `first`: the cycle begins that interval.
        """
        interval = periods if interval is None else interval
        if periods == self.periods and interval == self.interval and first is self.first:
            return
        if periods > len(self.demand):
            self._make_room(periods)
        if periods != self.periods:
            self._cut(periods)
        self.interval = interval
        self.first = first
        for servo in self._servos.values():
            servo.begin(self)

    def join(self, axis: int, servo: Servo) -> None:
        """Whom to tell of an axis how long cycles are: its drive's."""
        self._servos[axis] = servo
        servo.begin(self)

    def take_cycle(self) -> tuple[NDArray[Any], ...]:
        """What compiled code needs to run the coming cycle by itself: as `servo_period` takes it, and where positions go.

        Parameters, state, loops, demand (periods, n, 4), noise (periods, n), trace (periods, n).
        """
        return self.parameters, self.state, self.loops, self.demand, self._noise_rows(self.periods), self.trace

    def rehearsal(self) -> tuple[NDArray[Any], ...]:
        """The same for no period at all: nothing is drawn."""
        return self.parameters, self.state, self.loops, self.demand, self._noise_rows(0), self.trace

    def run(self, period: int, motor_position: NDArray[np.float64], motor_torque: NDArray[np.float64]) -> None:
        """Run the loops for one period of the cycle: read motor positions (n,) [rad], write motor torques (n,) [N·m]."""
        if period == 0:
            fill_demands(self.courses, self.demand[: self.periods], self.length)
        servo_period(
            self.parameters,
            self.state,
            self.loops,
            self.demand[period],
            self._noise_rows(1)[0],
            motor_position,
            motor_torque,
            self.length,
        )
        self.trace[period] = self.state["position"]

    def _make_room(self, periods: int) -> None:
        axes = len(self.parameters)
        self.demand = np.zeros((periods, axes, 4))
        self.trace = np.zeros((periods, axes))
        self._cut(periods)

    def _cut(self, periods: int) -> None:
        """Views of the demand of each axis, kept from cycle to cycle."""
        self.periods = periods
        self.demands: list[NDArray[np.float64]] = [self.demand[:periods, axis] for axis in range(self.demand.shape[1])]

    def _noise_rows(self, count: int) -> NDArray[np.float64]:
        """The next rows (count, axes) of unit noise."""
        if self._next_noise + count > len(self._noise):
            drawn = self._random.standard_normal((max(NOISE_ROWS, count), len(self.parameters)))
            self._noise = np.concatenate([self._noise[self._next_noise :], drawn])
            self._next_noise = 0
        self._next_noise += count
        rows: NDArray[np.float64] = self._noise[self._next_noise - count : self._next_noise]
        return rows


def encoder_quantum(increments_per_revolution: int) -> float:
    """Angle of one encoder increment [rad]."""
    return 2.0 * pi / increments_per_revolution
