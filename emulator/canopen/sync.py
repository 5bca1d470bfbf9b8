"""SYNC, consumed and produced: the common cycle of all nodes (CiA 301, 7.2.5; 1005h, 1006h, 1007h, 1019h)."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.can_identifier import BIT_30, CAN_ID, check_cob_id
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.emergency import SYNC_LENGTH, Emergency, ErrorRegister
from drivetwin.emulator.canopen.nmt import Nmt, NmtState
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.canopen.producer import Produce, Producer
from drivetwin.emulator.canopen.timing import TOLERANCE

MICROSECOND = 1e-6

DEFAULT_CYCLE = 0.001
"""Communication cycle where 1006h is 0 [s]."""

COUNTER_OVERFLOWS = frozenset((0, *range(2, 241)))
"""Values of 1019h: 0 is a SYNC without a counter (CiA 301, 7.5.2.22)."""


class Sync:
    """SYNC of one node; `acts` is what its services do at each, in this order.

    `cob_id` is the CAN-ID of the SYNC that this node listens to, `counter` that of the SYNC which came last, None where it had
    none. `changed` is called after 1007h or the CAN-ID has changed.
    """

    def __init__(
        self, od: ObjectDictionary, emergency: Emergency, now: Callable[[], float], changed: Callable[[], None]
    ) -> None:
        self._emergency = emergency
        self._now = now
        self._changed = changed
        self._parameter = od[0x1005]
        self._parameter.on_write = self._check_cob_id
        self._cycle = od[0x1006]
        self._window_length = od.get(0x1007)
        self._overflow = od.get(0x1019)
        if self._window_length is not None:
            self._window_length.on_write = self._set_window
        if self._overflow is not None:
            self._overflow.on_write = self._set_overflow
        self.acts: tuple[Callable[[], None], ...] = ()
        self.counter: int | None = None
        self._producer: Producer | None = None
        self._last_sent = 0
        self.load()

    @property
    def cycle(self) -> float:
        """Communication cycle that the node was told (1006h) [s], 0 where it was told none."""
        return int(self._cycle.value) * MICROSECOND

    @property
    def windowed(self) -> bool:
        """Whether synchronous RPDOs have to come within a time after SYNC (1007h is not 0)."""
        return self._window > 0.0

    @property
    def counted(self) -> bool:
        """Whether SYNC carries a counter (1019h is not 0)."""
        return self._counted

    def add_producer(self, nmt: Nmt, produce: Produce, alarms: Alarms) -> None:
        """Let it send SYNC where 1005h bit 30 says so, every 1006h, as nobody else moves time (CiA 301, 7.5.2.5)."""
        self._producer = Producer(nmt, produce, self._now, alarms, self._next_frame)
        self._cycle.on_write = lambda value: self._produce(self._parameter.number, int(value))
        nmt.on_change.append(self._begin_counting)

    def load(self) -> None:
        """Take everything as it stands in the dictionary, and forget what has come."""
        self.cob_id = self._parameter.number & CAN_ID
        self._produce(self._parameter.number, self._cycle.number)
        self.counter = None
        self._came = self._now()
        self._length_is_wrong = False
        self._window = self._window_length.number * MICROSECOND if self._window_length is not None else 0.0
        self._counted = self._overflow is not None and self._overflow.number != 0

    def take(self, data: bytes) -> None:
        """A SYNC came, perhaps with a counter."""
        counter = data[0] if data else None
        if (counter is None) is self._counted or self._length_is_wrong:
            self._judge_length(counter)
        self.counter = counter
        if self._window:
            self._came = self._now()
        for act in self.acts:
            act()

    def window_is_open(self) -> bool:
        """Whether a synchronous RPDO that comes now is in time.

        Simulated time moves by whole communication cycles, so what comes within the cycle of the window's end is in time.
        """
        cycle = self._cycle.number * MICROSECOND or DEFAULT_CYCLE
        return self._now() <= self._came + self._window + cycle + TOLERANCE

    def _judge_length(self, counter: int | None) -> None:
        """Tell a SYNC whose length is not what 1019h says once, and when it is right again; it is obeyed nevertheless."""
        wrong = (counter is None) is self._counted
        if wrong and not self._length_is_wrong:
            self._emergency.raise_error(SYNC_LENGTH, ErrorRegister.COMMUNICATION)
        elif self._length_is_wrong and not wrong:
            self._emergency.clear_error(SYNC_LENGTH)
        self._length_is_wrong = wrong

    def _check_cob_id(self, value: Value) -> None:
        """Bit 30: the node produces SYNC, and its CAN-ID is fixed meanwhile; bit 31 has no meaning and is kept as written."""
        new, old = int(value), self._parameter.number
        if new & BIT_30 and self._producer is None:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        check_cob_id(new & ~BIT_30)
        if new & old & BIT_30 and (new ^ old) & CAN_ID:
            raise SdoAbort(AbortCode.DEVICE_STATE)
        self.cob_id = new & CAN_ID
        self._produce(new, self._cycle.number)
        self._changed()

    def _produce(self, cob_id: int, microseconds: int) -> None:
        if self._producer is not None:
            self._last_sent = 0
            self._producer.run(microseconds * MICROSECOND if cob_id & BIT_30 else 0.0)

    def _next_frame(self) -> tuple[int, bytes]:
        """The counter goes from 1 to 1019h and begins again (CiA 301, 7.2.5.3.2)."""
        if not self._counted or self._overflow is None:
            return self.cob_id, b""
        self._last_sent = self._last_sent % self._overflow.number + 1
        return self.cob_id, bytes((self._last_sent,))

    def _begin_counting(self, state: NmtState) -> None:
        if state is NmtState.STOPPED:
            self._last_sent = 0

    def _set_window(self, value: Value) -> None:
        self._window = int(value) * MICROSECOND
        self._came = self._now()
        self._changed()

    def _set_overflow(self, value: Value) -> None:
        if int(value) not in COUNTER_OVERFLOWS:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        if self._cycle.number:
            raise SdoAbort(AbortCode.DEVICE_STATE)
        self._counted = int(value) != 0
