"""Coming to a standstill: by 6084h, by 6085h or at the current limit, as the option codes 605Ah..605Eh say, or coasting."""

from __future__ import annotations

from enum import Enum, auto
from math import isfinite

from emulator.drive.mode import Axis
from emulator.drive.ramp import ramp_cycle
from emulator.drive.servo import POSITION, TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop
from emulator.drive.state_machine import Stop


class Way(Enum):
    """How the axis is stopped."""

    COAST = auto()
    SLOW_DOWN_RAMP = auto()
    QUICK_STOP_RAMP = auto()
    TORQUE_LIMIT = auto()


_RAMPS = {Way.SLOW_DOWN_RAMP: 0x6084, Way.QUICK_STOP_RAMP: 0x6085}
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

STANDSTILL = 0.5
"""Motor speed below which a stop at the current limit goes on as holding the position [rad/s]."""


class Stops:
    """Fills the demand of a drive that is stopping or holding, and knows where the demand stands."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
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

    def measure(self) -> None:
        """A stop that follows starts from what the axis does, not from a demand."""
        state = self._axis.servo.state
        self.position, self.velocity = float(state["position"]), float(state["velocity"])

    def note(self) -> None:
        """A stop that follows starts from the end of the demand that is planned."""
        last = self._axis.servo.demand[-1]
        self.position, self.velocity = float(last[POSITION]), float(last[VELOCITY])

    def coast(self) -> None:
        """No torque."""
        self._axis.servo.loop = Loop.OFF
        self.measure()

    def run(self, way: Way) -> bool:
        """Plan a cycle of stopping; whether the axis' demand stands at its end."""
        if way is Way.COAST:
            self.coast()
            return True
        if way is Way.TORQUE_LIMIT and not self._slow():
            self._brake()
            return False
        self._ramp(_RAMPS.get(way, 0x6085))
        return self.velocity == 0.0

    def _way_of(self, option_code: int) -> Way:
        return OPTIONS[option_code].get(int(self._axis.dictionary[option_code].value), Way.QUICK_STOP_RAMP)

    def _slow(self) -> bool:
        standing = abs(self.velocity) < STANDSTILL
        if self._axis.servo.loop is Loop.VELOCITY:
            self.measure()
            standing = abs(self.velocity) < STANDSTILL
        if standing:
            self.velocity = 0.0
        return standing

    def _brake(self) -> None:
        """All torque that the limits allow, against the motion."""
        servo = self._axis.servo
        servo.demand[:] = 0.0
        servo.demand[:, POSITION] = float(servo.state["position"])
        servo.loop = Loop.VELOCITY

    def _ramp(self, index: int) -> None:
        axis = self._axis
        servo = axis.servo
        position = self.position if servo.loop is Loop.POSITION else float(servo.state["position"])
        deceleration = axis.ramp(index)
        ramp_cycle(position, self.velocity, 0.0, deceleration, deceleration, servo.demand)
        servo.demand[:, VELOCITY_OFFSET] = 0.0
        servo.demand[:, TORQUE_OFFSET] = 0.0
        servo.loop = Loop.POSITION
        if isfinite(servo.demand[-1, POSITION]):
            self.note()
