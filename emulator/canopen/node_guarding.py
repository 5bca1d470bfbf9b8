"""The older way of seeing each other: node guarding by the master, life guarding by the node (CiA 301, 7.2.8.3.2.1,
100Ch, 100Dh).
"""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.emergency import GUARDING, Emergency, ErrorRegister
from drivetwin.emulator.canopen.error_behaviour import ErrorBehaviour
from drivetwin.emulator.canopen.heartbeat import BASE_COB_ID, MILLISECOND, Heartbeat
from drivetwin.emulator.canopen.nmt import Nmt
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary

TOGGLE = 0x80


class NodeGuarding:
    """NMT slave that answers the master's remote frames and, by life guarding, sees when they stay away.

    A node does not guard and beat at once: while 1017h is not 0 the heartbeat alone is used (CiA 301, 7.2.8.3.2).
    """

    def __init__(
        self,
        od: ObjectDictionary,
        nmt: Nmt,
        heartbeat: Heartbeat,
        emergency: Emergency,
        behaviour: ErrorBehaviour,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
        alarms: Alarms,
    ) -> None:
        self.present = 0x100C in od and 0x100D in od
        self._nmt = nmt
        self._heartbeat = heartbeat
        self._emergency = emergency
        self._behaviour = behaviour
        self._transmit = transmit
        self._now = now
        self._alarm = alarms.add(self._tell_missing)
        self._toggle = 0
        self._is_missing = False
        if self.present:
            self._guard_time, self._factor = od[0x100C], od[0x100D]

    @property
    def cob_id(self) -> int:
        """CAN-ID of the master's remote frame and of the answer."""
        return BASE_COB_ID + self._nmt.node_id

    def reset(self) -> None:
        """Begin anew: the first answer has toggle bit 0, life guarding waits for the first remote frame."""
        self._toggle = 0
        self._is_missing = False
        self._alarm.stop()

    def request(self) -> None:
        """The master asks: answer the state with the toggle bit."""
        if self._heartbeat.active:
            return
        self._transmit(self.cob_id, bytes((self._toggle | self._nmt.state,)))
        self._toggle ^= TOGGLE
        if self._is_missing:
            self._is_missing = False
            self._emergency.clear_error(GUARDING)
        life_time = self._life_time()
        if life_time:
            self._alarm.set(self._now() + life_time)
        else:
            self._alarm.stop()

    def _life_time(self) -> float:
        """Guard time x life time factor [s]; 0: no life guarding."""
        return self._guard_time.number * self._factor.number * MILLISECOND

    def _tell_missing(self, _now: float) -> None:
        if self._heartbeat.active or not self._life_time():
            return
        self._is_missing = True
        self._emergency.raise_error(GUARDING, ErrorRegister.COMMUNICATION)
        self._behaviour.communication_error(GUARDING)
