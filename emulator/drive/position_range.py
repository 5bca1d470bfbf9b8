"""Rotary axes: positions that repeat within the range of 607Bh, and the way to one by 60F2h (CiA 402-2)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import floor

from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.foundation.enums import quick

RANGE, SOFTWARE_LIMIT = 0x607B, 0x607D
INT32 = (-(1 << 31), (1 << 31) - 1)
HALF_UNIT = 0.5
"""What lies less than this behind is here, and not a turn ahead."""


@quick
class Rotary(IntEnum):
    """Rotary axis direction option: bits 6 and 7 of 60F2h."""

    LIKE_A_LINEAR_AXIS = 0
    NEGATIVE = 1
    POSITIVE = 2
    SHORTEST = 3


@dataclass(frozen=True)
class PositionRange:
    """Positions are told from `low` to below `low + span`, in user units, and every `span` the axis is where it was."""

    low: float
    span: float

    @classmethod
    def of(cls, dictionary: ObjectDictionary) -> PositionRange | None:
        """607Bh: 'on reaching or exceeding these limits, the value wraps to the other end'; None where nothing repeats.

        So it is at 0 and 0, and at the ends of the type. For a drive type without 607Dh, 607Bh is its stroke.
        """
        if (RANGE, 1) not in dictionary or (SOFTWARE_LIMIT, 1) not in dictionary:
            return None
        low, high = (float(dictionary[RANGE, sub].value) for sub in (1, 2))
        return None if low >= high or (low, high) == INT32 else cls(low, high - low)

    def wrap(self, position: float) -> float:
        """The position as it is told."""
        return self.low + (position - self.low) % self.span

    def target(self, position: float, here: float, option: Rotary) -> float:
        """Where to go from `here` to be at `position`; both and the result count turns. A tie is positive."""
        if option is Rotary.LIKE_A_LINEAR_AXIS:
            return self.wrap(position) + floor((here - self.low) / self.span) * self.span
        ahead = (position - here) % self.span
        if ahead > self.span - HALF_UNIT:
            ahead -= self.span
        if option is Rotary.POSITIVE:
            return here + ahead
        if option is Rotary.NEGATIVE:
            return here + ahead - (self.span if ahead >= HALF_UNIT else 0.0)
        return here + ahead - (self.span if ahead > self.span / 2.0 else 0.0)
