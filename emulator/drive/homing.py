"""Homing mode (6): finds the machine's zero by the method of 6098h (CiA 402-2, clause 'Homing'); methods are data."""

from __future__ import annotations

from enum import Enum, auto
from typing import ClassVar

import numpy as np

from drivetwin.drive_profiles import Quirk
from drivetwin.emulator.drive.hardware import NEVER
from drivetwin.emulator.drive.homing_methods import METHODS, Edge, Here, Input, Method, NextIndex
from drivetwin.emulator.drive.mode import Axis, Mode, Ramps
from drivetwin.emulator.drive.ramp import ramp_cycle
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, VELOCITY_OFFSET, Loop
from drivetwin.emulator.drive.state_machine import Controlword, Statusword
from drivetwin.foundation.enums import quick

NOT_HOMED, HOMED = 0, 1
"""What the object of role `homing_status` tells."""


@quick
class Phase(Enum):
    """Where a homing run stands."""

    IDLE = auto()
    SEEK = auto()
    """Fast, until the switch is actuated; turning round at a limit switch."""
    LEAVE = auto()
    """Fast, off the switch against the direction of the crossing."""
    CROSS = auto()
    """Slow, over the edge."""
    INDEX = auto()
    """Slow, to the index pulse."""
    SETTLE = auto()
    DONE = auto()
    ERROR = auto()


_RUNNING = (Phase.SEEK, Phase.LEAVE, Phase.CROSS, Phase.INDEX)


class Homing(Mode):
    """One engine for all methods. Edges and pulses are caught at the servo period, not at the communication cycle.

    The zero is then 607Ch (home offset) beyond the home position: zero position = home position + home offset. The run ends
    when bit 4 is cleared, but on drives that latch the start (`Quirk.HOMING_LATCHES_START`).
    """

    code: ClassVar[int] = 6

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._phase = Phase.IDLE
        self._homed = False
        self._started = self._held = self._pulsed = False
        self._latches = Quirk.HOMING_LATCHES_START in axis.profile.quirks
        self._status = axis.role("homing_status")
        self._method: Method = Here()
        self._seek = 0
        self._turned = False
        self._before = 0.0
        self._position = 0.0
        self._velocity = 0.0

    def enter(self) -> None:
        state = self.axis.servo.state
        self._position, self._velocity = float(state["position"]), float(state["velocity"])
        self._before = self._position
        self._phase = Phase.IDLE
        self._started = self._held = self._pulsed = False

    def notice(self, controlword: int) -> None:
        """A rising edge of bit 4, though the bit may fall again within the cycle."""
        start = bool(controlword & Controlword.MODE_BIT_4)
        self._pulsed = self._pulsed or (start and not self._held)
        self._held = start

    def ramps(self) -> Ramps:
        """609Ah slows down in this mode."""
        return Ramps(self.axis.ramp(0x609A), self.axis.ramp(0x6085))

    def plan(self, controlword: int) -> Loop:
        start = bool(controlword & Controlword.MODE_BIT_4)
        if (start and not self._started) or (self._latches and self._pulsed):
            self._begin()
        self._pulsed = False
        if not start and not self._latches and self._phase in _RUNNING:
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
        if self._phase in _RUNNING:
            for angle in self.axis.servo.positions.tolist():
                self._look(self._before, angle)
                self._before = angle
        self._before = float(self.axis.servo.positions[-1])
        if self._phase is Phase.SETTLE and self._velocity == 0.0:
            self._phase = Phase.DONE

    def status_bits(self) -> int:
        if self._pulsed:
            return 0  # in progress, though the cycle that begins it is still to come
        if self._phase is Phase.ERROR:
            return Statusword.MODE_BIT_13 | (Statusword.TARGET_REACHED if self._velocity == 0.0 else 0)
        if self._phase is Phase.DONE:
            return Statusword.MODE_BIT_12 | Statusword.TARGET_REACHED
        if self._phase in _RUNNING and self._speed() == 0.0:
            return Statusword.WARNING  # 6099h is 0: it will never end
        if self._phase is not Phase.IDLE:
            return 0
        return Statusword.TARGET_REACHED | (Statusword.MODE_BIT_12 if self._homed else 0)

    def lose_reference(self) -> None:
        """The zero is none any more: a reset, or the encoder is lost."""
        self._tell(NOT_HOMED)

    # -- the run ------------------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        self._tell(NOT_HOMED)
        method = METHODS.get(int(self.axis.dictionary[0x6098].value))
        self._turned = False
        if method is None or (self._needs_home(method) and self.axis.hardware.home_switch is None):
            self._phase = Phase.ERROR
            return
        self._method = method
        if isinstance(method, Here):
            self._home_at(float(self.axis.servo.state["position"]))
            self._phase = Phase.DONE
        elif isinstance(method, NextIndex):
            self._phase = Phase.INDEX
        else:
            self._seek = method.seek
            self._phase = Phase.SEEK

    def _look(self, before: float, angle: float) -> None:
        """What a servo period brought: motor angles [rad] at its beginning and its end."""
        method = self._method
        if self._phase is Phase.INDEX:
            self._look_for_index(before, angle)
        elif isinstance(method, Edge):
            if self._phase is Phase.SEEK:
                self._look_for_switch(method, angle)
            elif self._phase is Phase.LEAVE:
                if self._goes(-method.cross) and self._actuated(method, before) and not self._actuated(method, angle):
                    self._phase = Phase.CROSS
            elif self._phase is Phase.CROSS:
                self._look_for_edge(method, before, angle)
        if self._phase in _RUNNING and self._blocked(angle):
            self._turn_round()

    def _look_for_switch(self, method: Edge, angle: float) -> None:
        if self._actuated(method, angle):
            self._phase = Phase.LEAVE if method.onto else Phase.CROSS

    def _look_for_edge(self, method: Edge, before: float, angle: float) -> None:
        was, now = self._actuated(method, before), self._actuated(method, angle)
        if not self._goes(method.cross) or was == now or now != method.onto:
            return
        if method.index:
            self._phase = Phase.INDEX
        else:
            self._end_at(angle)

    def _look_for_index(self, before: float, angle: float) -> None:
        if self._goes(self._direction()) and self.axis.hardware.index_pulses(np.array([before, angle]))[0]:
            self._end_at(angle)

    def _blocked(self, angle: float) -> bool:
        """Whether the limit switch is actuated towards which the axis is to move, and is not what the method looks for."""
        direction = self._direction()
        if isinstance(self._method, Edge) and self._phase is Phase.SEEK and self._method.input is not Input.HOME:
            return False
        return self._limit(direction, angle)

    def _turn_round(self) -> None:
        """A limit switch: the other way, once, while seeking; an error else."""
        if self._phase is Phase.SEEK and not self._turned:
            self._turned = True
            self._seek = -self._seek
        else:
            self._phase = Phase.ERROR

    def _end_at(self, angle: float) -> None:
        self._home_at(angle)
        self._phase = Phase.SETTLE

    def _home_at(self, angle: float) -> None:
        offset = self.axis.scaling.angular_distance(float(self.axis.dictionary[0x607C].value))
        self.axis.move_origin(angle + offset)
        self._tell(HOMED)

    def _tell(self, status: int) -> None:
        """Homing attained, and bit 0 of the drive type's own homing status; both outlive the mode, as the zero does."""
        self._homed = status == HOMED
        if self._status is not None:
            self._status.value = status

    # -- directions and inputs ----------------------------------------------------------------------------------------

    def _direction(self) -> int:
        """Direction of the present phase, in user units."""
        if self._phase is Phase.SEEK:
            return self._seek
        if isinstance(self._method, Here):
            return 0
        return -self._method.cross if self._phase is Phase.LEAVE else self._method.cross

    def _sign(self, direction: int) -> float:
        """Sign of motor motion in a direction of user units."""
        return float(direction) if self.axis.scaling.position_per_radian > 0.0 else -float(direction)

    def _goes(self, direction: int) -> bool:
        return self._velocity * self._sign(direction) > 0.0

    def _limit(self, direction: int, angle: float) -> bool:
        return self.axis.limit_switch(direction, angle)

    def _actuated(self, method: Edge, angle: float) -> bool:
        if method.input is Input.HOME:
            return (self.axis.hardware.home_switch or NEVER).actuated(angle)
        return self._limit(-1 if method.input is Input.NEGATIVE_LIMIT else 1, angle)

    @staticmethod
    def _needs_home(method: Method) -> bool:
        return isinstance(method, Edge) and method.input is Input.HOME

    def _speed(self) -> float:
        """Motor speed of the present phase [rad/s]: 6099h:01 for the switch, 6099h:02 for the zero."""
        if self._phase not in _RUNNING:
            return 0.0
        fast, slow = (abs(self.axis.scaling.angular(float(self.axis.dictionary[0x6099, sub].value))) for sub in (1, 2))
        searching = self._phase in (Phase.SEEK, Phase.LEAVE)
        return self._sign(self._direction()) * (fast if searching else slow)
