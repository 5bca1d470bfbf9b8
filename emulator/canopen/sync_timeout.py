"""Supervision of the bus by SYNC, for drive types without a heartbeat consumer: P2061 and P2062 of a ServoOne.

Known are the names, COM_CAN_TIMEOUT_TYPE and COM_CAN_TIMEOUT_VALUE, and that both are UNSIGNED16. The rest is a reading: type 0
is off, type 1 wants a SYNC within VALUE milliseconds of the one before, from the first one on; no other type is accepted.
"""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.emergency import COMMUNICATION
from drivetwin.emulator.canopen.heartbeat import MILLISECOND
from drivetwin.emulator.canopen.object_dictionary import Variable
from drivetwin.emulator.canopen.timing import TOLERANCE

OFF, SYNC = 0, 1
"""Types of supervision."""


class SyncTimeout:
    """Calls `lost` with the error code once, when a SYNC that is due has not come; the next SYNC arms it again."""

    def __init__(
        self, kind: Variable, time: Variable, now: Callable[[], float], alarms: Alarms, lost: Callable[[int], None]
    ) -> None:
        self._kind = kind
        self._time = time
        self._now = now
        self._lost = lost
        self._due = 0.0
        self._is_armed = False
        self._alarm = alarms.add(self._ring)
        kind.on_write = self._set_kind
        time.on_write = lambda _value: self.reset()

    def reset(self) -> None:
        """Wait for a first SYNC."""
        self._alarm.stop()
        self._is_armed = False

    def came(self) -> None:
        """A SYNC came: the next one is due. An alarm that is set already rings too early, and is then set anew."""
        if self._kind.value == SYNC and self._time.value:
            self._due = self._now() + int(self._time.value) * MILLISECOND
            if not self._is_armed:
                self._is_armed = True
                self._alarm.set(self._due)

    def _ring(self, now: float) -> None:
        self._is_armed = self._due - TOLERANCE > now
        if self._is_armed:
            self._alarm.set(self._due)
        else:
            self._lost(COMMUNICATION)

    def _set_kind(self, value: Value) -> None:
        if value not in (OFF, SYNC):
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self.reset()
