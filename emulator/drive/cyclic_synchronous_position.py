"""Cyclic synchronous position mode (8): the controller interpolates, the drive follows 607Ah (CiA 402-2, clause 'csp')."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.emulator.drive.interpolator import Interpolator
from drivetwin.emulator.drive.limits import PositionLimits
from drivetwin.emulator.drive.mode import Axis, Mode
from drivetwin.emulator.drive.position_range import Rotary
from drivetwin.emulator.drive.servo import Loop
from drivetwin.emulator.drive.state_machine import Statusword


class CyclicSynchronousPosition(Mode):
    """Target position 607Ah, velocity offset 60B1h and torque offset 60B2h, each cycle."""

    code: ClassVar[int] = 8

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._interpolator = Interpolator(axis.servo)
        self._wanted = 0.0
        self._limits = PositionLimits(axis)
        self._target = axis.dictionary[0x607A]

    def enter(self) -> None:
        self._wanted = float(self.axis.servo.state["position"])
        self._interpolator.start_at(self._wanted)

    def plan(self, controlword: int) -> Loop:
        axis = self.axis
        servo = axis.servo
        if servo.takes_setpoints:
            target = axis.scaling.target(float(self._target.value), self._interpolator.setpoint, Rotary.SHORTEST)
            self._wanted = self._limits.clamp(target)
        self._interpolator.follow(self._wanted, axis.interpolation, axis.set_point_interval, axis.offsets())
        return Loop.POSITION

    def status_bits(self) -> int:
        """Bit 12: the drive follows the command value, which no limit has cut."""
        return 0 if self.axis.limit_active else Statusword.MODE_BIT_12

    def following_error_bits(self) -> int:
        return Statusword.MODE_BIT_13
