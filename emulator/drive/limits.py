"""Limits of position (607Dh), speed (607Fh, 6080h) and torque (6072h, 60E0h, 60E1h), on the motor shaft (CiA 402-2)."""

from __future__ import annotations

from math import inf, pi, sqrt

from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.drive.axis import Axis
from drivetwin.emulator.drive.objects import number, optional
from drivetwin.emulator.drive.scaling import Scaling
from drivetwin.emulator.machine import Motor

RPM = 2.0 * pi / 60.0
INT32 = (-(1 << 31), (1 << 31) - 1)


class PositionLimits:
    """Software position limits 607Dh [rad], counted from the zero; a drive type without them has its stroke in 607Bh.

    A limit at the end of its type is none; so are both where the lower is not below the upper, as a ServoOne has 0 and 0
    until somebody sets them.
    """

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._low, self._high = (_position_limit(axis, sub) for sub in (1, 2))
        self._revision, self._seen = axis.dictionary.revision, -1
        self._scaling: Scaling | None = None
        self._bounds = (-inf, inf)

    def bounds(self) -> tuple[float, float]:
        """Least and greatest motor angle [rad]; infinite where there is no limit."""
        if self._revision.number != self._seen or self._axis.scaling is not self._scaling:
            self._seen, self._scaling = self._revision.number, self._axis.scaling
            self._bounds = self._read(number(self._low, INT32[0]), number(self._high, INT32[1]))
        return self._bounds

    def clamp(self, angle: float) -> float:
        """The nearest allowed angle [rad]; one that is not allowed makes the internal limit active."""
        low, high = self.bounds()
        if low <= angle <= high:
            return angle
        self._axis.limit_active = True
        return low if angle < low else high

    def cap_speed(self, speed: float, position: float, deceleration: float) -> float:
        """`speed` [rad/s], or the highest from which the axis still stops at the limit that it runs towards.

        v = sqrt(2 a d) for a distance d to the limit and a deceleration a; beyond the limit only the way back is open.
        """
        low, high = self.bounds()
        ahead = high - position if speed > 0.0 else position - low
        if ahead == inf:
            return speed
        most = self._stoppable(max(ahead, 0.0), deceleration)
        if abs(speed) <= most:
            return speed
        self._axis.limit_active = True
        return most if speed > 0.0 else -most

    def _stoppable(self, ahead: float, deceleration: float) -> float:
        """Highest speed for the coming cycle, at whose end the rest of the way must still do for the ramp."""
        cycle = self._axis.cycle
        if deceleration * cycle * cycle > ahead:
            return 0.5 * ahead / cycle
        lost = deceleration * cycle
        return sqrt(lost * lost + 2.0 * deceleration * ahead) - lost

    def _read(self, low: float, high: float) -> tuple[float, float]:
        if low >= high:
            return -inf, inf
        scaling = self._axis.scaling
        ends = [
            scaling.angle(raw) if raw != none else none * inf * (1.0 if scaling.position_per_radian > 0.0 else -1.0)
            for raw, none in zip((low, high), INT32, strict=True)
        ]
        return min(ends), max(ends)


def _position_limit(axis: Axis, subindex: int) -> Variable | None:
    own = optional(axis.dictionary, 0x607D, subindex)
    return optional(axis.dictionary, 0x607B, subindex) if own is None else own


def speed_limit(axis: Axis) -> float:
    """Highest motor speed [rad/s]: 607Fh (user units a second) and 6080h (rpm); 0 is no limit."""
    dictionary = axis.dictionary
    limit = abs(axis.scaling.angular(float(dictionary[0x607F].value))) or inf
    return min(limit, motor_speed_limit(axis))


def motor_speed_limit(axis: Axis) -> float:
    """6080h [rad/s]; 0, the greatest value, or no such object is no limit.

    It is in rpm, or where 6095h ('velocity factor 1': motor data * numerator / divisor = velocity units) is not 1:1, in what
    that makes velocity units of.
    """
    raw = number(optional(axis.dictionary, 0x6080), 0.0)
    if not 0 < raw < 0xFFFFFFFF:
        return inf
    factor = number(optional(axis.dictionary, 0x6095, 1), 1.0) / number(optional(axis.dictionary, 0x6095, 2), 1.0)
    return raw * RPM if factor == 1.0 else abs(axis.scaling.angular(raw * factor))


def cap_speed(axis: Axis, speed: float) -> float:
    """`speed` [rad/s] within the speed limits; one that is cut makes the internal limit active."""
    limit = speed_limit(axis)
    if abs(speed) <= limit:
        return speed
    axis.limit_active = True
    return limit if speed > 0.0 else -limit


class TorqueLimits:
    """Puts 6072h, 6073h, 60E0h, 60E1h, the drive type's own limit and the motor's peak torque into the loops."""

    def __init__(self, axis: Axis, motor: Motor) -> None:
        self._axis = axis
        self._motor = motor

    def refresh(self) -> None:
        """Write the limits [N·m] into the loops' parameters."""
        parameters = self._axis.servo.parameters
        own = self._axis.role("torque_limit")
        limits = (self._share(0x6072), self._of_current(), self._motor.peak_torque)
        limit = min(*limits, inf if own is None else float(own.value))
        parameters["torque_limit"] = limit
        parameters["torque_positive"] = self._share(0x60E0)
        parameters["torque_negative"] = self._share(0x60E1)

    def _of_current(self) -> float:
        """Torque [N·m] that the motor has at 6073h, in thousandths of the rated current 6075h [mA]."""
        dictionary, motor = self._axis.dictionary, self._motor
        rated = number(optional(dictionary, 0x6075), 1000.0 * motor.rated_current) / 1000.0
        share = number(optional(dictionary, 0x6073), inf) / 1000.0
        return share * rated * motor.rated_torque / motor.rated_current if rated > 0.0 else 0.0

    def _share(self, index: int) -> float:
        """Torque [N·m] of an object in thousandths of rated torque; infinite where the drive has none."""
        raw = number(optional(self._axis.dictionary, index), inf)
        return raw if raw == inf else raw * self._axis.rated_torque() / 1000.0
