"""Homing mode (6): finds the machine's zero at a limit switch, or takes the present position (CiA 402-2, clause 'Homing')."""

from __future__ import annotations

from enum import Enum, auto
from typing import ClassVar

from emulator.drive.mode import Axis, Mode
from emulator.drive.ramp import ramp_cycle
from emulator.drive.servo import TORQUE_OFFSET, VELOCITY_OFFSET, Loop
from emulator.drive.state_machine import Controlword, Statusword

ON_NEGATIVE_SWITCH, ON_POSITIVE_SWITCH, ON_CURRENT_POSITION_OLD, ON_CURRENT_POSITION = 17, 18, 35, 37
METHODS = (ON_NEGATIVE_SWITCH, ON_POSITIVE_SWITCH, ON_CURRENT_POSITION_OLD, ON_CURRENT_POSITION)


class Phase(Enum):
    """Where a homing run stands."""

    IDLE = auto()
    SEARCH = auto()
    LEAVE = auto()
    SETTLE = auto()
    DONE = auto()
    ERROR = auto()


class Homing(Mode):
    """Methods 17 and 18: run into the limit switch at 6099h:01, leave it at 6099h:02, home where it releases.

    The edge is caught at the servo period, not at the communication cycle. The zero is then 607Ch (home offset)
    beyond it: zero position = home position + home offset.
    """

    code: ClassVar[int] = 6

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._phase = Phase.IDLE
        self._started = False
        self._position = 0.0
        self._velocity = 0.0

    def enter(self) -> None:
        state = self.axis.servo.state
        self._position, self._velocity = float(state["position"]), float(state["velocity"])
        self._phase = Phase.IDLE
        self._started = False

    def plan(self, controlword: int) -> Loop:
        start = bool(controlword & Controlword.MODE_BIT_4)
        if start and not self._started:
            self._begin()
        if not start and self._phase in (Phase.SEARCH, Phase.LEAVE):
            self._phase = Phase.IDLE
        self._started = start
        axis = self.axis
        demand = axis.servo.demand
        acceleration = axis.ramp(0x609A)
        ramp_cycle(self._position, self._velocity, self._speed(), acceleration, acceleration, demand)
        demand[:, VELOCITY_OFFSET] = 0.0
        demand[:, TORQUE_OFFSET] = 0.0
        self._position, self._velocity = float(demand[-1, 0]), float(demand[-1, 1])
        return Loop.POSITION

    def after(self) -> None:
        if self._phase is Phase.SEARCH and self._on_switch(float(self.axis.servo.positions[-1])):
            self._phase = Phase.LEAVE
        elif self._phase is Phase.LEAVE and self._velocity * self._direction() < 0.0:
            for angle in self.axis.servo.positions:
                if not self._on_switch(float(angle)):
                    self._home_at(float(angle))
                    self._phase = Phase.SETTLE
                    break
        elif self._phase is Phase.SETTLE and self._velocity == 0.0:
            self._phase = Phase.DONE

    def status_bits(self) -> int:
        if self._phase is Phase.ERROR:
            return Statusword.MODE_BIT_13 | (Statusword.TARGET_REACHED if self._velocity == 0.0 else 0)
        if self._phase is Phase.DONE:
            return Statusword.MODE_BIT_12 | Statusword.TARGET_REACHED
        return Statusword.TARGET_REACHED if self._phase is Phase.IDLE else 0

    def _begin(self) -> None:
        method = self._method()
        if method in (ON_CURRENT_POSITION, ON_CURRENT_POSITION_OLD):
            self._home_at(float(self.axis.servo.state["position"]))
            self._phase = Phase.DONE
        else:
            self._phase = Phase.SEARCH if method in METHODS else Phase.ERROR

    def _home_at(self, angle: float) -> None:
        offset = self.axis.scaling.angular_distance(float(self.axis.dictionary[0x607C].value))
        self.axis.move_origin(angle + offset)

    def _method(self) -> int:
        return int(self.axis.dictionary[0x6098].value)

    def _direction(self) -> float:
        """Sign of motor motion towards the switch."""
        towards = -1.0 if self._method() == ON_NEGATIVE_SWITCH else 1.0
        return towards if self.axis.scaling.position_per_radian > 0.0 else -towards

    def _on_switch(self, angle: float) -> bool:
        switches = self.axis.switches
        return switches.negative(angle) if self._direction() < 0.0 else switches.positive(angle)

    def _speed(self) -> float:
        """Motor speed of the present phase [rad/s]."""
        fast, slow = (abs(self.axis.scaling.angular(float(self.axis.dictionary[0x6099, sub].value))) for sub in (1, 2))
        if self._phase is Phase.SEARCH:
            return self._direction() * fast
        if self._phase is Phase.LEAVE:
            return -self._direction() * slow
        return 0.0
