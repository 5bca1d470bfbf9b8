"""Interpolation time period 60C2h: how long the drive takes from one streamed set-point to the next (CiA 402-2)."""

from __future__ import annotations

from fractions import Fraction

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.drive.objects import optional
from drivetwin.emulator.drive.servo import SERVO_PERIOD

LONGEST = 10
"""A longer period is refused [s]."""

POWERS, MILLISECONDS = range(-6, 1), -3
"""Of ten: what 60C2h:02 may be, and is where a drive type has none."""

MICROSECOND, DEFAULT_CYCLE = Fraction(1, 1_000_000), Fraction(1, 1000)


class InterpolationTime:
    """60C2h:01 times ten to the power of 60C2h:02 seconds; it has to be whole communication cycles (1006h, or 1 ms).

    That is judged when :01 is written: a master writes one after the other, :02 first where :01 alone would not be whole.
    """

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._cycle = dictionary[0x1006]
        self._value, self._index = (optional(dictionary, 0x60C2, subindex) for subindex in (1, 2))
        if self._value is not None:
            self._value.on_write = lambda value: self._check(int(value))
        if self._index is not None:
            self._index.on_write = _check_index
        self._revision, self._seen = dictionary.revision, -1
        self._periods = 0

    def periods(self) -> int:
        """In servo periods; 0 where the drive type has no 60C2h."""
        if self._revision.number != self._seen and self._value is not None:
            self._seen = self._revision.number
            self._periods = round(min(self._value.number * 10.0 ** self._power(), LONGEST) / SERVO_PERIOD)
        return self._periods

    def _power(self) -> int:
        return MILLISECONDS if self._index is None else self._index.number

    def _check(self, value: int) -> None:
        period = value * Fraction(10) ** self._power()
        cycle = self._cycle.number * MICROSECOND or DEFAULT_CYCLE
        if not 0 < period <= LONGEST or (period / cycle).denominator != 1:
            raise SdoAbort(AbortCode.INVALID_VALUE)


def _check_index(index: Value) -> None:
    if index not in POWERS:
        raise SdoAbort(AbortCode.INVALID_VALUE)
