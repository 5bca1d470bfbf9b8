"""How a master sees that the node is there: boot-up and heartbeat (CiA 301, 7.2.8.3.2.2, 7.2.8.3.3, 1017h)."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.nmt import Nmt, NmtState
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary

BASE_COB_ID = 0x700
MILLISECOND = 1e-3


class Heartbeat:
    """Producer of one node."""

    def __init__(
        self,
        od: ObjectDictionary,
        nmt: Nmt,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
        alarms: Alarms,
    ) -> None:
        self._nmt = nmt
        self._transmit = transmit
        self._now = now
        self._period = 0.0
        self._due = 0.0
        self._alarm = alarms.add(self._beat)
        self._time = od[0x1017]
        self._time.on_write = self._set_period

    @property
    def active(self) -> bool:
        """Whether the node produces heartbeats (1017h is not 0)."""
        return self._time.number > 0

    def boot_up(self) -> None:
        """Tell that initialisation is done, and begin as 1017h stands."""
        self._transmit(BASE_COB_ID + self._nmt.node_id, bytes((NmtState.INITIALISING,)))
        self._set_period(self._time.value)

    def stop(self) -> None:
        """Send nothing any more: a node that loses its node-ID."""
        self._alarm.stop()

    def _beat(self, now: float) -> None:
        """Send the state; a period that was missed altogether is not made up."""
        self._transmit(BASE_COB_ID + self._nmt.node_id, bytes((self._nmt.state,)))
        self._due += self._period
        if self._due <= now:
            self._due = now + self._period
        self._alarm.set(self._due)

    def _set_period(self, value: Value) -> None:
        self._period = int(value) * MILLISECOND
        if not self._period:
            self._alarm.stop()
            return
        self._due = self._now() + self._period
        self._alarm.set(self._due)
