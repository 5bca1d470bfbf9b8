"""Profile velocity mode (3): the drive ramps its speed to 60FFh (CiA 402-2, clause 'Profile velocity mode')."""

from __future__ import annotations

from math import inf
from typing import ClassVar

from drivetwin.emulator.drive.limits import cap_speed
from drivetwin.emulator.drive.mode import Axis, Mode
from drivetwin.emulator.drive.profile_generator import Bounds
from drivetwin.emulator.drive.profile_jerk import profile_jerk
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, VELOCITY_OFFSET, Loop
from drivetwin.emulator.drive.speed_demand import SpeedDemand
from drivetwin.emulator.drive.state_machine import Statusword
from drivetwin.emulator.drive.windows import Window

REACHED = 0.01
"""Share of the target speed within which it counts as reached, where the drive has no 606Dh."""
STANDING = 0.05
"""Motor speed that counts as 0, where the drive has no 606Fh [rad/s]."""


class ProfileVelocity(Mode):
    """Ramps by 6083h and 6084h, with a jerk where 6086h says so, within 607Fh and 6080h, and stops at a software limit.

    Bit 10: within 606Dh of 60FFh for 606Eh, and so not where a limit cuts it. Bit 12: speed 0, not beyond 606Fh for 6070h.
    """

    code: ClassVar[int] = 3

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._speed = SpeedDemand(axis)
        self._target = self._asked = 0.0
        self._reached, self._moving = Window(), Window()

    def enter(self) -> None:
        self._speed.start()
        self._reached.restart()
        self._moving.restart()

    def plan(self, controlword: int) -> Loop:
        axis, speed = self.axis, self._speed
        up, down = axis.ramp(0x6083), axis.ramp(0x6084)
        self._asked = axis.scaling.angular(float(axis.dictionary[0x60FF].value))
        wanted = cap_speed(axis, self._asked)
        self._target = speed.position_allows(wanted, down)
        jerk = profile_jerk(axis, up)
        if jerk == inf or self._target != wanted:  # at a software limit the ramp has to do
            speed.ramp(self._target, up, down)
        else:
            speed.smooth(wanted, Bounds(inf, up, down, jerk))
        demand = axis.servo.demand
        demand[:, VELOCITY_OFFSET] = axis.velocity_offset()
        demand[:, TORQUE_OFFSET] = axis.torque_offset()
        return Loop.VELOCITY

    def after(self) -> None:
        actual, cycle = float(self.axis.servo.state["velocity"]), self.axis.cycle
        window = self._window(0x606D, max(REACHED * abs(self._asked), STANDING))
        self._reached.look(abs(actual - self._asked) < window, self._time(0x606E), cycle)
        self._moving.look(abs(actual) >= self._window(0x606F, STANDING), self._time(0x6070), cycle)

    def status_bits(self) -> int:
        reached = Statusword.TARGET_REACHED if self._reached.held else 0
        standing = 0 if self._moving.held else Statusword.MODE_BIT_12
        return reached | standing

    def _window(self, index: int, otherwise: float) -> float:
        """A window or threshold [rad/s]."""
        dictionary = self.axis.dictionary
        return abs(self.axis.scaling.angular(float(dictionary[index].value))) if index in dictionary else otherwise

    def _time(self, index: int) -> float:
        """A time [s]."""
        dictionary = self.axis.dictionary
        return float(dictionary[index].value) / 1000.0 if index in dictionary else 0.0
