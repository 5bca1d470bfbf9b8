"""Stopping: by 6084h, by 6085h, at the current limit, as the option codes 605Ah..605Eh select, or coasting."""

from __future__ import annotations

from enum import Enum, auto
from math import inf, isfinite

from drivetwin.emulator.drive.mode import Axis, Mode, Ramps
from drivetwin.emulator.drive.ramp import ramp_cycle
from drivetwin.emulator.drive.servo import POSITION, SERVO_PERIOD, TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop
from drivetwin.emulator.drive.state_machine import Stop
from drivetwin.emulator.drive.windows import Window
from drivetwin.foundation.enums import quick


@quick
class Way(Enum):
    """How the axis is stopped."""

    COAST = auto()
    SLOW_DOWN_RAMP = auto()
    QUICK_STOP_RAMP = auto()
    TORQUE_LIMIT = auto()


_FIRST_FOUR = {1: Way.SLOW_DOWN_RAMP, 2: Way.QUICK_STOP_RAMP, 3: Way.TORQUE_LIMIT, 4: Way.TORQUE_LIMIT}
OPTIONS: dict[int, dict[int, Way]] = {
    0x605A: {0: Way.COAST, **_FIRST_FOUR, **{option + 4: way for option, way in _FIRST_FOUR.items()}},
    0x605B: {0: Way.COAST, 1: Way.SLOW_DOWN_RAMP},
    0x605C: {0: Way.COAST, 1: Way.SLOW_DOWN_RAMP},
    0x605D: _FIRST_FOUR,
    0x605E: {0: Way.COAST, **_FIRST_FOUR},
}
"""CiA 402-2, tables of 605Ah..605Eh. At the voltage limit (4, 8) a drive of this plant is at its current limit (3, 7)."""

STAY_IN_QUICK_STOP = (5, 6, 7, 8)
"""Values of 605Ah after which the drive stays in 'quick stop active'."""

HOLDING = 0.5
"""Motor speed below which a stop at the current limit goes on as holding the position, and difference of speed with which
an axis still follows its demand [rad/s].
"""

STANDSTILL, STANDSTILL_TIME = 0.1, 0.005
"""An axis whose actual motor speed [rad/s] has been below this for so long [s] is at rest."""

PATIENCE = 1.0
"""For how long a stop waits for an axis that neither comes to rest nor gets slower, as one that oscillates [s]."""


class Stops:
    """Fills the demand of a drive that is stopping or holding, and knows whether the axis is at rest."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._mode: Mode | None = None
        self._way: Way | None = None
        self._follows_mode = False
        self._standstill = Window()
        self._slowest = inf
        self._waited = 0.0
        self._actual_velocity = axis.servo.state.cell("velocity")
        self.position = float(axis.servo.state["position"])
        self.velocity = 0.0

    def way(self, stop: Stop) -> Way:
        """How the option code of a stop says that the axis is stopped."""
        return self._way_of(stop.value)

    def halt_way(self) -> Way:
        """How 605Dh says that halt stops the axis."""
        return self._way_of(0x605D)

    def stays(self) -> bool:
        """Whether 605Ah says to stay in quick stop active."""
        return int(self._axis.dictionary[0x605A].value) in STAY_IN_QUICK_STOP

    @property
    def at_rest(self) -> bool:
        """The axis has been standing, and so does the demand of its speed, where there is one."""
        return self._standstill.held and (self.velocity == 0.0 or self._axis.servo.loop is Loop.TORQUE)

    def measure(self) -> None:
        """A stop that follows starts from what the axis does, not from a demand."""
        self._way = None
        self._follows_mode = False
        self.position, self.velocity = float(self._axis.servo.state["position"]), self._speed()

    def note(self, mode: Mode, loop: Loop) -> None:
        """The demand of a mode is planned: a stop that follows starts at its end, if it is of motion and the axis follows."""
        self._mode = mode
        if loop is Loop.TORQUE:
            self.measure()
            return
        self._way = None
        self._follows_mode = True

    def coast(self) -> None:
        """No torque."""
        self._mode = None
        self._standstill.restart()
        self._axis.servo.loop = Loop.OFF
        self.measure()

    def run(self, way: Way) -> bool:
        """Plan a cycle of stopping; whether the stop has ended: the axis is at rest, or it does not come to rest."""
        if way is Way.COAST:
            self.coast()
            return True
        if way is not self._way:
            self._begin(way)
        self._follows_mode = False
        if way is Way.TORQUE_LIMIT and not self._slow():
            self._brake()
        else:
            self._ramp(way)
        return self.at_rest or self._waited >= PATIENCE

    def after(self) -> None:
        """Look at what the cycle brought: does the axis stand? Where did the demand end, or does a stop get slower?"""
        speed, cycle = abs(self._actual_velocity[0]), self._axis.servo.periods * SERVO_PERIOD
        self._standstill.look(speed < STANDSTILL, STANDSTILL_TIME, cycle)
        if self._follows_mode:
            self._note()
            return
        ramping = self.velocity != 0.0
        self._waited = 0.0 if ramping or speed < self._slowest else self._waited + cycle
        self._slowest = min(self._slowest, speed)

    def _way_of(self, option_code: int) -> Way:
        return OPTIONS[option_code].get(int(self._axis.dictionary[option_code].value), Way.QUICK_STOP_RAMP)

    def _speed(self) -> float:
        speed: float = self._actual_velocity[0]
        return speed

    def _begin(self, way: Way) -> None:
        """Start at the speed of the axis, and at the demanded position only where the axis follows it.

        Else the position is the one from which the loop goes on with that speed: following error (1 - feed-forward) v / Kp.
        """
        speed = self._speed()
        if not self._follows(speed):
            parameters = self._axis.servo.parameters
            gain, left = float(parameters["position_gain"]), 1.0 - float(parameters["velocity_feedforward"])
            self.position = float(self._axis.servo.state["position"]) + (left * speed / gain if gain > 0.0 else 0.0)
        self.velocity = speed
        self._way = way
        self._slowest, self._waited = inf, 0.0

    def _follows(self, speed: float) -> bool:
        """Whether the axis moves as demanded, and what its loops still ask for is no more than rated torque."""
        servo = self._axis.servo
        if servo.loop is not Loop.POSITION or abs(self.velocity - speed) > HOLDING:
            return False
        error = abs(float(servo.state["velocity_demand"]) - speed)
        return float(servo.parameters["velocity_gain"]) * error <= self._axis.rated_torque()

    def _slow(self) -> bool:
        """Whether an axis that is stopped at the current limit can be held; from then on it is."""
        servo = self._axis.servo
        if servo.loop is Loop.POSITION and self.velocity == 0.0:
            return True
        if abs(self._speed()) >= HOLDING:
            return False
        if servo.loop is Loop.VELOCITY:
            self.position = float(servo.state["position"])
        self.velocity = 0.0
        return True

    def _brake(self) -> None:
        """All torque that the limits allow, against the motion."""
        servo = self._axis.servo
        servo.demand[:] = 0.0
        servo.demand[:, POSITION] = float(servo.state["position"])
        servo.loop = Loop.VELOCITY
        self._note()

    def _ramp(self, way: Way) -> None:
        servo = self._axis.servo
        ramps = Ramps.of(self._axis) if self._mode is None else self._mode.ramps()
        deceleration = ramps.slow_down if way is Way.SLOW_DOWN_RAMP else ramps.quick_stop
        ramp_cycle(self.position, self.velocity, 0.0, deceleration, deceleration, servo.demand)
        servo.demand[:, VELOCITY_OFFSET] = 0.0
        servo.demand[:, TORQUE_OFFSET] = 0.0
        servo.loop = Loop.POSITION
        if isfinite(servo.demand[-1, POSITION]):
            self._note()

    def _note(self) -> None:
        demand = self._axis.servo.demand
        self.position, self.velocity = demand.item(-1, POSITION), demand.item(-1, VELOCITY)
