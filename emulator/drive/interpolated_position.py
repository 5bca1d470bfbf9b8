"""Interpolated position mode (7): set-points from 60C1h, smoothed between SYNCs (CiA 402-2, clause 'Interpolated position')."""

from __future__ import annotations

from typing import ClassVar

from drivetwin.emulator.drive.interpolator import Interpolator
from drivetwin.emulator.drive.limits import PositionLimits
from drivetwin.emulator.drive.mode import Axis, Mode
from drivetwin.emulator.drive.position_range import Rotary
from drivetwin.emulator.drive.servo import Loop
from drivetwin.emulator.drive.state_machine import Controlword, Statusword


class InterpolatedPosition(Mode):
    """Follows 60C1h:01 while controlword bit 4 enables it; else holds the last demand."""

    code: ClassVar[int] = 7

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._interpolator = Interpolator(axis.servo)
        self._limits = PositionLimits(axis)
        self._setpoint = axis.dictionary[0x60C1, 1]
        self._hold = 0.0
        self._active = False

    def enter(self) -> None:
        self._hold = float(self.axis.servo.state["position"])
        self._interpolator.start_at(self._hold)
        self._active = False

    def plan(self, controlword: int) -> Loop:
        axis = self.axis
        servo = axis.servo
        self._active = bool(controlword & Controlword.MODE_BIT_4)
        if self._active and servo.takes_setpoints:
            self._hold = self._limits.clamp(axis.scaling.target(float(self._setpoint.value), self._hold, Rotary.SHORTEST))
        self._interpolator.follow(self._hold, axis.interpolation, axis.set_point_interval, axis.offsets())
        return Loop.POSITION

    def status_bits(self) -> int:
        return Statusword.MODE_BIT_12 if self._active else 0
