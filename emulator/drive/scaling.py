"""The factor group: user units of the bus to radians of the motor shaft (CiA 402-2, clause 'Factor group').

Position increments = user units * encoder resolution (608Fh) * gear ratio (6091h) / feed constant (6092h); velocities and
accelerations are the same a second and a second squared. The factors of DSP 402 version 2 say the result instead of its
parts, user units * numerator / divisor = increments: 6093h for positions, 6094h for velocities [increments/s], 6097h for
accelerations [increments/s²]. One that is 1:1 is not used. 6096h, 'velocity factor' of CiA 402-2, has user units * numerator /
divisor = position units a second, where 6094h is not used. A notation index (6089h, 608Bh, 608Dh) is the power of ten of the
user unit, its dimension that of the feed constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.drive.objects import number, optional
from drivetwin.emulator.drive.position_range import INT32, RANGE, PositionRange, Rotary

FRACTIONS = (0x608F, 0x6091, 0x6092, 0x6093, 0x6094, 0x6096, 0x6097)
NOTATIONS = (0x6089, 0x608B, 0x608D)
POLARITY = 0x607E
FACTOR_GROUP = (
    *((index, sub) for index in (*FRACTIONS, RANGE) for sub in (1, 2)),
    *((index, 0) for index in (*NOTATIONS, POLARITY)),
)
"""Every entry that the scaling depends on."""

LEAST, MOST = INT32

POSITION_POLARITY, VELOCITY_POLARITY = 1 << 7, 1 << 6
"""Bits of 607Eh."""


@dataclass(frozen=True)
class Scaling:
    """position [user] = (motor angle - origin) * position_per_radian; velocity and acceleration likewise, of rad/s and rad/s².

    Signs of positions and velocities are by 607Eh. Positions repeat where there is a `range`.
    """

    position_per_radian: float
    velocity_per_radian: float
    acceleration_per_radian: float
    origin: float
    range: PositionRange | None = None

    @classmethod
    def of(cls, dictionary: ObjectDictionary, increments_per_radian: float, origin: float) -> Scaling:
        """Scaling by the factor group as it stands; a drive type without one of its objects has the neutral value."""
        base = _position_per_radian(dictionary, increments_per_radian)
        velocity_factor = _factor(dictionary, 0x6094)
        acceleration_factor = _factor(dictionary, 0x6097)
        velocity = base / (_factor(dictionary, 0x6096) or 1.0)
        if velocity_factor is not None:
            velocity = increments_per_radian / velocity_factor
        acceleration = velocity if acceleration_factor is None else increments_per_radian / acceleration_factor
        polarity = int(number(optional(dictionary, POLARITY), 0.0))
        return cls(
            position_per_radian=_signed(base, polarity & POSITION_POLARITY) * _decimal(dictionary, 0x6089),
            velocity_per_radian=_signed(velocity, polarity & VELOCITY_POLARITY) * _decimal(dictionary, 0x608B),
            acceleration_per_radian=acceleration * _decimal(dictionary, 0x608D),
            origin=origin,
            range=PositionRange.of(dictionary),
        )

    def position(self, angle: float) -> int:
        """Position in user units of a motor angle [rad], within its range and 32 bits."""
        position = (angle - self.origin) * self.position_per_radian
        nearest = round(position if self.range is None else self.range.wrap(round(position)))
        return nearest if LEAST <= nearest <= MOST else MOST if nearest > MOST else LEAST

    def angle(self, position: float) -> float:
        """Motor angle [rad] of a position in user units."""
        return self.angular_distance(position) + self.origin

    def target(self, position: float, here: float, option: Rotary) -> float:
        """Motor angle [rad] to go to from the angle `here` [rad] to be at a position in user units."""
        if self.range is not None:
            position = self.range.target(position, (here - self.origin) * self.position_per_radian, option)
        return position / self.position_per_radian + self.origin

    def distance(self, angular: float) -> int:
        """Difference of positions in user units, of a difference of motor angles [rad]."""
        return to_int32(angular * self.position_per_radian)

    def angular_distance(self, distance: float) -> float:
        """Difference of motor angles [rad], of a difference of positions in user units."""
        return distance / self.position_per_radian

    def velocity(self, angular: float) -> int:
        """Velocity in user units a second of a motor speed [rad/s]."""
        return to_int32(angular * self.velocity_per_radian)

    def angular(self, velocity: float) -> float:
        """Motor speed [rad/s] of one in user units."""
        return velocity / self.velocity_per_radian

    def angular_acceleration(self, acceleration: float) -> float:
        """Amount of the motor acceleration [rad/s²] of one in user units; of a jerk [rad/s³] likewise."""
        return abs(acceleration / self.acceleration_per_radian)


def to_int32(value: float) -> int:
    """Nearest integer that a 32-bit object can hold."""
    nearest = round(value)
    return nearest if LEAST <= nearest <= MOST else MOST if nearest > MOST else LEAST


def default_increments_per_radian(increments_per_revolution: int) -> float:
    """Encoder increments a radian of the motor shaft."""
    return increments_per_revolution / (2.0 * pi)


def _position_per_radian(dictionary: ObjectDictionary, increments_per_radian: float) -> float:
    factor = _factor(dictionary, 0x6093)
    if factor is not None:
        return increments_per_radian / factor
    increments = increments_per_radian * 2.0 * pi
    resolution = _fraction(dictionary, 0x608F, increments)
    gear, feed = _fraction(dictionary, 0x6091, 1.0), _fraction(dictionary, 0x6092, increments)
    return increments_per_radian * feed / (resolution * gear)


def _fraction(dictionary: ObjectDictionary, index: int, otherwise: float) -> float:
    """Sub-index 1 over sub-index 2; `otherwise` where the drive type has no such object."""
    return number(optional(dictionary, index, 1), otherwise) / number(optional(dictionary, index, 2), 1.0)


def _factor(dictionary: ObjectDictionary, index: int) -> float | None:
    """A factor that is used: the drive type has it, and it is not 1:1."""
    factor = _fraction(dictionary, index, 1.0)
    return None if factor == 1.0 else factor


def _decimal(dictionary: ObjectDictionary, index: int) -> float:
    return float(10.0 ** -number(optional(dictionary, index), 0.0))


def _signed(factor: float, is_turned: int) -> float:
    return -factor if is_turned else factor
