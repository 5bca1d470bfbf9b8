"""The factor group: user units of the bus to radians of the motor shaft (CiA 402-2, clause 'Factor group')."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from emulator.canopen.object_dictionary import ObjectDictionary

FACTOR_GROUP = ((0x608F, 1), (0x608F, 2), (0x6091, 1), (0x6091, 2), (0x6092, 1), (0x6092, 2))
POSITION_POLARITY, VELOCITY_POLARITY = 1 << 7, 1 << 6
"""Bits of 607Eh."""


@dataclass(frozen=True)
class Scaling:
    """position [user] = (motor angle - origin) * position_per_radian; velocity likewise, a second. Signs are by 607Eh."""

    position_per_radian: float
    velocity_per_radian: float
    origin: float

    @classmethod
    def of(cls, dictionary: ObjectDictionary, increments_per_radian: float, origin: float) -> Scaling:
        """Scaling by 608Fh, 6091h, 6092h and 607Eh as they stand.

        position = increments * feed constant / (encoder resolution * gear ratio).
        """
        increments, revolutions, motor, shaft, feed, feed_shaft = (
            float(dictionary[index, sub].value) for index, sub in FACTOR_GROUP
        )
        resolution = increments / revolutions
        user = increments_per_radian * (feed / feed_shaft) / (resolution * (motor / shaft))
        polarity = int(dictionary[0x607E].value)
        return cls(
            position_per_radian=-user if polarity & POSITION_POLARITY else user,
            velocity_per_radian=-user if polarity & VELOCITY_POLARITY else user,
            origin=origin,
        )

    def position(self, angle: float) -> int:
        """Position in user units of a motor angle [rad], within 32 bits."""
        return self.distance(angle - self.origin)

    def angle(self, position: float) -> float:
        """Motor angle [rad] of a position in user units."""
        return self.angular_distance(position) + self.origin

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
        """Motor speed [rad/s] or acceleration [rad/s²] of one in user units."""
        return velocity / self.velocity_per_radian


def to_int32(value: float) -> int:
    """Nearest integer that a 32-bit object can hold."""
    return max(-(1 << 31), min((1 << 31) - 1, round(value)))


def default_increments_per_radian(increments_per_revolution: int) -> float:
    """Encoder increments a radian of the motor shaft."""
    return increments_per_revolution / (2.0 * pi)
