"""Process data to the master: a transmit PDO (CiA 301, 7.2.2, 1800h.. and 1A00h..)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import inf

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.data_types import Value, saturate
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.canopen.pdo_mapping import maps_to_tpdo
from drivetwin.emulator.canopen.pdo_parameters import INHIBIT_UNIT, SYNCHRONOUS, PdoParameters
from drivetwin.emulator.canopen.sync import Sync
from drivetwin.emulator.canopen.timing import TOLERANCE

ACYCLIC = 0
REMOTE_SYNCHRONOUS = 252
REMOTE = 253
EVENT_DRIVEN = (254, 255)
TRANSMISSION_TYPES = frozenset((*SYNCHRONOUS, REMOTE_SYNCHRONOUS, REMOTE, *EVENT_DRIVEN))

EVENT_UNIT = 1e-3


class Tpdo:
    """Transmit PDO `number` (1..).

    `on_sync`, `tick` and `request` are called when a SYNC, time, or a remote frame may let it send; the `at_...`
    properties say which of them the PDO listens to.
    """

    def __init__(
        self,
        od: ObjectDictionary,
        number: int,
        transmit: Callable[[int, bytes], None],
        now: Callable[[], float],
        sync: Sync,
        changed: Callable[[], None],
    ) -> None:
        self._sync = sync
        self._transmit = transmit
        self._now = now
        self._changed = changed
        self._event_period = self._event_due = inf
        self.parameters = PdoParameters(
            od,
            0x17FF + number,
            0x19FF + number,
            types=TRANSMISSION_TYPES,
            rule=maps_to_tpdo,
            changed=self._configure,
        )
        self._inhibit_time = od[0x17FF + number, 3]
        self._inhibit_time.on_write = self.parameters.refuse_while_existing
        self._event_timer = od[0x17FF + number, 5]
        self._event_timer.on_write = self._set_event_timer
        self._start_value = od.get((0x17FF + number, 6))
        if self._start_value is not None:
            self._start_value.on_write = self._check_start_value
        self.start()

    @property
    def at_sync(self) -> bool:
        """Whether a SYNC makes it sample."""
        return self.parameters.synchronous or self.parameters.transmission_type == REMOTE_SYNCHRONOUS

    @property
    def at_tick(self) -> bool:
        """Whether a change of its objects, or time, makes it send."""
        return self.parameters.transmission_type in EVENT_DRIVEN

    @property
    def on_sync(self) -> Callable[[], None]:
        """What to do at a SYNC."""
        if self.parameters.transmission_type == ACYCLIC:
            return self._send_if_changed
        if self.parameters.transmission_type == REMOTE_SYNCHRONOUS:
            return self._keep_sample
        return self._send_every_nth_from_start if self._start_at else self._send_every_nth

    def start(self) -> None:
        """Begin anew with the parameters as they stand: an event-driven PDO sends its first value at the next tick."""
        parameters = self.parameters
        self._cob_id = parameters.cob_id
        self._variables = parameters.mapping.variables
        self._pack = parameters.mapping.layout.pack
        self._cycle = self._countdown = parameters.transmission_type
        self._start_at = self._start_value.number if self._start_value is not None else 0
        self._sent: bytes | None = None
        self._kept: bytes | None = None
        self._inhibit = self._inhibit_time.number * INHIBIT_UNIT - TOLERANCE
        self._inhibited_until = -inf
        self._set_event_timer(self._event_timer.value)

    def tick(self, now: float) -> None:
        """Send if a mapped value changed or the event timer ran out, and the inhibit time allows it."""
        data = self._sample()
        if (data == self._sent and now < self._event_due) or now < self._inhibited_until:
            return
        self._inhibited_until = now + self._inhibit
        self._event_due = now + self._event_period
        self._sent = data
        self._transmit(self._cob_id, data)

    def request(self) -> None:
        """Answer a remote frame: with the last sample where SYNC does the sampling, else with the values now."""
        data = self._kept if self.at_sync and self._kept is not None else self._sample()
        self._transmit(self._cob_id, data)

    def _configure(self) -> None:
        self.start()
        self._changed()

    def _set_event_timer(self, value: Value) -> None:
        self._event_period = int(value) * EVENT_UNIT - TOLERANCE if value else inf
        self._event_due = self._now() + self._event_period

    def _send_every_nth(self) -> None:
        self._countdown -= 1
        if self._countdown:
            return
        self._countdown = self._cycle
        self._kept = data = self._sample()
        self._transmit(self._cob_id, data)

    def _send_every_nth_from_start(self) -> None:
        """The SYNC whose counter is the start value (:06) is the first one (CiA 301, 7.5.2.37); without counters, any is."""
        if self._start_at and self._sync.counted and self._sync.counter != self._start_at:
            return
        self._start_at = 0
        self._send_every_nth()

    def _check_start_value(self, value: Value) -> None:
        self.parameters.refuse_while_existing(value)
        if int(value) not in SYNCHRONOUS:
            raise SdoAbort(AbortCode.INVALID_VALUE)

    def _send_if_changed(self) -> None:
        self._kept = data = self._sample()
        if data != self._sent:
            self._sent = data
            self._transmit(self._cob_id, data)

    def _keep_sample(self) -> None:
        self._kept = self._sample()

    def _sample(self) -> bytes:
        try:
            return self._pack(*[one.value if one.on_read is None else one.on_read() for one in self._variables])
        except (struct.error, OverflowError):
            return self._sample_saturated()

    def _sample_saturated(self) -> bytes:
        """Some value is beyond its type: tell the nearest."""
        return self._pack(*[saturate(variable.data_type, variable.read()) for variable in self._variables])
