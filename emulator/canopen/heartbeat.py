"""How a master sees that the node is there: boot-up and heartbeat (CiA 301, 7.2.8.3.2.2, 7.2.8.3.3, 1017h)."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from emulator.canopen.data_types import Value
from emulator.canopen.nmt import Nmt, NmtState
from emulator.canopen.object_dictionary import ObjectDictionary
from emulator.canopen.timing import TOLERANCE

BASE_COB_ID = 0x700
MILLISECOND = 1e-3


class Heartbeat:
    """Producer of one node; `tick` sends what is due."""

    def __init__(
        self,
        node_id: int,
        od: ObjectDictionary,
        nmt: Nmt,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
    ) -> None:
        self._cob_id = BASE_COB_ID + node_id
        self._nmt = nmt
        self._transmit = transmit
        self._now = now
        self._period = 0.0
        self.due = inf
        self._time = od[0x1017]
        self._time.on_write = self._set_period

    def boot_up(self) -> None:
        """Tell that initialisation is done, and begin as 1017h stands."""
        self._transmit(self._cob_id, bytes((NmtState.INITIALISING,)))
        self._set_period(self._time.value)

    def tick(self, now: float) -> None:
        """Send the state where a period has passed; a period that was missed altogether is not made up."""
        if now < self.due - TOLERANCE:
            return
        self._transmit(self._cob_id, bytes((self._nmt.state,)))
        self.due += self._period
        if self.due <= now:
            self.due = now + self._period

    def _set_period(self, value: Value) -> None:
        self._period = int(value) * MILLISECOND
        self.due = self._now() + self._period if self._period else inf
