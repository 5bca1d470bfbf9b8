"""The factor group: user units of the bus to radians of the motor shaft (CiA 402-2, clause 'Factor group')."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from emulator.canopen.object_dictionary import ObjectDictionary

FACTOR_GROUP = ((0x608F, 1), (0x608F, 2), (0x6091, 1), (0x6091, 2), (0x6092, 1), (0x6092, 2))
POSITION_POLARITY = 1 << 7


@dataclass(frozen=True)
class Scaling:
    """position [user] = (motor angle - origin) * user_per_radian; velocity in user units a second."""

    user_per_radian: float
    origin: float

    @classmethod
    def of(cls, dictionary: ObjectDictionary, increments_per_radian: float, origin: float) -> Scaling:
        """Scaling by 608Fh, 6091h, 6092h and 607Eh as they stand.

        position = increments * feed constant / (encoder resolution * gear ratio). A zero counts as one, as in a drive fresh
        from its box.
        """
        increments, revolutions, motor, shaft, feed, feed_shaft = (
            float(dictionary[index, sub].value) or 1.0 for index, sub in FACTOR_GROUP
        )
        resolution = increments / revolutions
        user = increments_per_radian * (feed / feed_shaft) / (resolution * (motor / shaft))
        sign = -1.0 if int(dictionary[0x607E].value) & POSITION_POLARITY else 1.0
        return cls(sign * user, origin)

    def position(self, angle: float) -> int:
        """Position in user units of a motor angle [rad], within 32 bits."""
        return to_int32((angle - self.origin) * self.user_per_radian)

    def angle(self, position: float) -> float:
        """Motor angle [rad] of a position in user units."""
        return position / self.user_per_radian + self.origin

    def velocity(self, angular: float) -> int:
        """Velocity in user units a second of a motor speed [rad/s]."""
        return to_int32(angular * self.user_per_radian)

    def angular(self, velocity: float) -> float:
        """Motor speed [rad/s] or acceleration [rad/s²] of one in user units."""
        return velocity / self.user_per_radian


def to_int32(value: float) -> int:
    """Nearest integer that a 32-bit object can hold."""
    return max(-(1 << 31), min((1 << 31) - 1, round(value)))


def default_increments_per_radian(increments_per_revolution: int) -> float:
    """Encoder increments a radian of the motor shaft."""
    return increments_per_revolution / (2.0 * pi)
