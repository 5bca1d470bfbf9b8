"""Velocity mode (2) of frequency converters: 6042h in rpm by the ramps 6048h and 6049h (CiA 402-2, clause 'Velocity mode')."""

from __future__ import annotations

from math import copysign, inf
from typing import ClassVar

from drivetwin.emulator.drive.limits import RPM, cap_speed
from drivetwin.emulator.drive.mode import Axis, Mode, Ramps
from drivetwin.emulator.drive.servo import TORQUE_OFFSET, VELOCITY_OFFSET, Loop
from drivetwin.emulator.drive.speed_demand import SpeedDemand
from drivetwin.emulator.drive.state_machine import Controlword

ENABLE_RAMP, UNLOCK_RAMP, REFERENCE_RAMP = Controlword.MODE_BIT_4, Controlword.MODE_BIT_5, Controlword.MODE_BIT_6


class Velocity(Mode):
    """Ramp function generator between 6042h and the velocity loop.

    Without bit 4 the loop is given 0 instead of the ramp's output; without bit 5 the ramp stands where it is; without bit 6
    its input is 0. 604Ch: speed [rpm] = value * numerator / denominator. 6046h bounds the amount of the speed.
    """

    code: ClassVar[int] = 2

    def __init__(self, axis: Axis) -> None:
        super().__init__(axis)
        self._speed = SpeedDemand(axis)

    def enter(self) -> None:
        self._speed.start()

    def ramps(self) -> Ramps:
        """6049h slows down in this mode, 604Ah stops quickly; 6085h where the drive has no 604Ah."""
        own = (0x604A, 1) in self.axis.dictionary
        return Ramps(self._ramp(0x6049), self._ramp(0x604A) if own else self.axis.ramp(0x6085))

    def plan(self, controlword: int) -> Loop:
        axis, down = self.axis, self._ramp(0x6049)
        self._speed.ramp(self._speed.position_allows(self._target(controlword), down), self._ramp(0x6048), down)
        demand = axis.servo.demand
        demand[:, VELOCITY_OFFSET] = 0.0
        demand[:, TORQUE_OFFSET] = axis.torque_offset()
        return Loop.VELOCITY

    def status_bits(self) -> int:
        """None: bits 10, 12 and 13 are reserved in this mode."""
        return 0

    def speed_value(self, speed: float) -> int:
        """6043h or 6044h of a motor speed [rad/s]."""
        per_unit = self._per_unit()
        return max(-32768, min(32767, round(speed / per_unit))) if per_unit != 0.0 else 0

    def _target(self, controlword: int) -> float:
        if not controlword & ENABLE_RAMP:
            return 0.0
        if not controlword & UNLOCK_RAMP:
            return self._speed.velocity
        if not controlword & REFERENCE_RAMP:
            return 0.0
        return cap_speed(self.axis, self._within_amounts(float(self.axis.dictionary[0x6042].value) * self._per_unit()))

    def _within_amounts(self, speed: float) -> float:
        least, most = (float(self.axis.dictionary[0x6046, sub].value) * abs(self._per_unit()) for sub in (1, 2))
        amount = abs(speed)
        if speed == 0.0 or least <= amount <= most:
            return speed
        self.axis.limit_active = True
        return copysign(least if amount < least else most, speed)

    def _per_unit(self) -> float:
        """Motor speed [rad/s] of one unit of 6042h, by 604Ch."""
        numerator, denominator = (float(self.axis.dictionary[0x604C, sub].value) for sub in (1, 2))
        return RPM * numerator / denominator if denominator != 0.0 else 0.0

    def _ramp(self, index: int) -> float:
        """Delta speed over delta time [rad/s²]; infinite where either is 0."""
        speed, time = (float(self.axis.dictionary[index, sub].value) for sub in (1, 2))
        rate = speed * abs(self._per_unit()) / time if time > 0.0 else inf
        return rate if rate > 0.0 else inf
