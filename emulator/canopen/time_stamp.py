"""The time of day that a master tells: the TIME consumer (CiA 301, 7.2.6, 1012h)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from datetime import datetime, timedelta

from emulator.canopen.abort_codes import AbortCode, SdoAbort
from emulator.canopen.can_identifier import BIT_30, CAN_ID, check_cob_id
from emulator.canopen.data_types import Value
from emulator.canopen.object_dictionary import ObjectDictionary

CONSUMER = 1 << 31
"""Bit 31 of 1012h: the node consumes TIME."""

EPOCH = datetime(1984, 1, 1)
"""Day 0 of TIME_OF_DAY (CiA 301, 7.1.6); the bus tells no time zone."""

_FRAME = struct.Struct("<IH")
_MILLISECONDS = 0x0FFFFFFF


class TimeStamp:
    """TIME consumer of one node. `changed` is called after a change of 1012h."""

    def __init__(self, od: ObjectDictionary, now: Callable[[], float], changed: Callable[[], None]) -> None:
        self._now = now
        self._changed = changed
        self._told: tuple[datetime, float] | None = None
        self._parameter = od.get(0x1012)
        self._cob_id = 0
        if self._parameter is not None:
            self._parameter.on_write = self._write
        self.load()

    @property
    def handlers(self) -> dict[int, Callable[[bytes], None]]:
        """What to do with TIME, by CAN-ID; nothing where the node does not consume it."""
        return {self._cob_id & CAN_ID: self.receive} if self._cob_id & CONSUMER else {}

    def load(self) -> None:
        """Take 1012h as it stands."""
        self._cob_id = self._parameter.number if self._parameter is not None else 0

    def receive(self, data: bytes) -> None:
        """A TIME message: milliseconds after midnight and days since 1984-01-01. Another length is not one."""
        if len(data) != _FRAME.size:
            return
        milliseconds, days = _FRAME.unpack(data)
        time = timedelta(days=days, milliseconds=milliseconds & _MILLISECONDS)
        self._told = (EPOCH + time, self._now())

    def time_of_day(self) -> datetime | None:
        """The time now, going on from what was told last; None before that."""
        if self._told is None:
            return None
        time, at = self._told
        return time + timedelta(seconds=self._now() - at)

    def _write(self, value: Value) -> None:
        # a drive is no TIME producer
        if int(value) & BIT_30:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        check_cob_id(int(value) & ~CONSUMER)
        self._cob_id = int(value)
        self._changed()
