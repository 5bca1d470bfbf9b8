"""TIME, the time of day, consumed and produced (CiA 301, 7.2.6, 1012h)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from datetime import datetime, timedelta

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.can_identifier import BIT_30, CAN_ID, check_cob_id
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.nmt import Nmt
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.canopen.producer import Produce, Producer

CONSUMER = 1 << 31
"""Bit 31 of 1012h: the node consumes TIME."""

EPOCH = datetime(1984, 1, 1)
"""Day 0 of TIME_OF_DAY (CiA 301, 7.1.6); the bus tells no time zone."""

PERIOD = 1.0
"""How often a producer tells the time [s]; CiA 301 leaves it to the device."""

_FRAME = struct.Struct("<IH")
_MILLISECONDS = 0x0FFFFFFF


class TimeStamp:
    """TIME of one node. `changed` is called after a change of 1012h."""

    def __init__(self, od: ObjectDictionary, now: Callable[[], float], changed: Callable[[], None]) -> None:
        self._now = now
        self._changed = changed
        self._told: tuple[datetime, float] | None = None
        self._parameter = od.get(0x1012)
        self._cob_id = 0
        self._producer: Producer | None = None
        if self._parameter is not None:
            self._parameter.on_write = self._write
        self.load()

    @property
    def handlers(self) -> dict[int, Callable[[bytes], None]]:
        """What to do with TIME, by CAN-ID; nothing where the node does not consume it."""
        return {self._cob_id & CAN_ID: self.receive} if self._cob_id & CONSUMER else {}

    def add_producer(self, nmt: Nmt, produce: Produce, alarms: Alarms) -> None:
        """Let it send TIME where 1012h bit 30 says so, every `PERIOD`."""
        self._producer = Producer(nmt, produce, self._now, alarms, self._next_frame)

    def load(self) -> None:
        """Take 1012h as it stands."""
        self._take(self._parameter.number if self._parameter is not None else 0)

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
        new = int(value)
        if new & BIT_30 and self._producer is None:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        check_cob_id(new & ~(CONSUMER | BIT_30))
        if new & self._cob_id & BIT_30 and (new ^ self._cob_id) & CAN_ID:
            raise SdoAbort(AbortCode.DEVICE_STATE)
        self._take(new)
        self._changed()

    def _take(self, cob_id: int) -> None:
        self._cob_id = cob_id
        if self._producer is not None:
            self._producer.run(PERIOD if cob_id & BIT_30 else 0.0)

    def _next_frame(self) -> tuple[int, bytes]:
        """The time that was told last and has gone on; a node that was told none counts from its power-on."""
        time = (self.time_of_day() or EPOCH + timedelta(seconds=self._now())) - EPOCH
        milliseconds = time.seconds * 1000 + time.microseconds // 1000
        return self._cob_id & CAN_ID, _FRAME.pack(milliseconds, time.days & 0xFFFF)
