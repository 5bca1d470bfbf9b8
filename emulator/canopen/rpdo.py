"""Process data from the master: a receive PDO (CiA 301, 7.2.2, 1400h.. and 1600h..)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from math import inf

from drivetwin.emulator.canopen.abort_codes import SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.emergency import PDO_TOO_LONG, PDO_TOO_SHORT, RPDO_TIME_OUT, Emergency, ErrorRegister
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable
from drivetwin.emulator.canopen.pdo_mapping import maps_to_rpdo
from drivetwin.emulator.canopen.pdo_parameters import INHIBIT_UNIT, SYNCHRONOUS, PdoParameters
from drivetwin.emulator.canopen.sync import Sync
from drivetwin.emulator.canopen.timing import TOLERANCE

logger = logging.getLogger(__name__)

TRANSMISSION_TYPES = frozenset((*SYNCHRONOUS, 254, 255))

EVENT_UNIT = 1e-3


class Rpdo:
    """Receive PDO `number` (1..). `receive` gets a frame's data; what is synchronous acts at the next `take_effect`."""

    def __init__(
        self,
        od: ObjectDictionary,
        number: int,
        emergency: Emergency,
        sync: Sync,
        now: Callable[[], float],
        alarms: Alarms,
        changed: Callable[[], None],
    ) -> None:
        self._number = number
        self._detail = bytes((number, 0, 0, 0, 0))
        self._emergency = emergency
        self._sync = sync
        self._now = now
        self._alarm = alarms.add(self._tell_missing)
        self._is_missing = False
        self._changed = changed
        self._pending: bytes | None = None
        self._length_error = 0
        self._written: tuple[tuple[int, Variable, bool], ...] = ()
        self.parameters = PdoParameters(
            od,
            0x13FF + number,
            0x15FF + number,
            types=TRANSMISSION_TYPES,
            rule=maps_to_rpdo,
            changed=self._configure,
        )
        self._inhibit_time = od.get((0x13FF + number, 3))
        if self._inhibit_time is not None:
            self._inhibit_time.on_write = self.parameters.refuse_while_existing
        self._inhibit_alarm = alarms.add(self._release)
        self._event_timer = od.get((0x13FF + number, 5))
        if self._event_timer is not None:
            self._event_timer.on_write = self._set_deadline
        self.start()

    @property
    def receive(self) -> Callable[[bytes], None]:
        """What to do with a frame: keep it for the SYNC, or act on it now; and look at the time where that matters."""
        return self._watch if self._deadline else self._take

    @property
    def _take(self) -> Callable[[bytes], None]:
        if not self.parameters.synchronous:
            return self._act_unless_inhibited if self._inhibit else self._act
        return self._keep_in_window if self._sync.windowed else self._keep

    def start(self) -> None:
        """Begin anew with the parameters as they stand: nothing is waiting for a SYNC."""
        mapping = self.parameters.mapping
        self._pending = None
        self._inhibit = self._inhibit_time.number * INHIBIT_UNIT if self._inhibit_time is not None else 0.0
        self._inhibited_until = -inf
        self._inhibit_alarm.stop()
        self._deadline = self._event_timer.number * EVENT_UNIT if self._event_timer is not None else 0.0
        self._alarm.stop()
        self._written = tuple((place, one, not one.takes_all) for place, one in _commands_last(mapping.variables))
        self._length = mapping.layout.size
        self._unpack = mapping.layout.unpack_from

    def stop(self) -> None:
        """PDOs are not allowed any more: none is missed, none waits."""
        self._alarm.stop()
        self._inhibit_alarm.stop()

    def take_effect(self) -> None:
        """It is time, by SYNC or by the inhibit time: act on what was received last."""
        data = self._pending
        if data is not None:
            self._pending = None
            self._act(data)

    def _configure(self) -> None:
        self.start()
        self._changed()

    def _keep(self, data: bytes) -> None:
        self._pending = data

    def _keep_in_window(self, data: bytes) -> None:
        """After the synchronous window (1007h) an RPDO is discarded; the next SYNC opens it again (CiA 301, 7.5.2.7)."""
        if self._sync.window_is_open():
            self._pending = data

    def _act_unless_inhibited(self, data: bytes) -> None:
        """Event-driven frames act no more often than the inhibit time (:03) allows; of those that wait the newest acts."""
        now = self._now()
        if now < self._inhibited_until - TOLERANCE:
            self._pending = data
            self._inhibit_alarm.set(self._inhibited_until)
            return
        self._inhibit_alarm.stop()
        self._inhibited_until = now + self._inhibit
        self._act(data)

    def _release(self, now: float) -> None:
        self._inhibited_until = now + self._inhibit
        self.take_effect()

    def _watch(self, data: bytes) -> None:
        """Deadline monitoring: the next frame is due within the event timer from now (CiA 301, 7.5.2.35, :05)."""
        self._alarm.set(self._now() + self._deadline)
        if self._is_missing:
            self._is_missing = False
            self._emergency.clear_error(RPDO_TIME_OUT, self._detail)
        self._take(data)

    def _tell_missing(self, _now: float) -> None:
        self._is_missing = True
        self._emergency.raise_error(RPDO_TIME_OUT, ErrorRegister.COMMUNICATION, self._detail)

    def _set_deadline(self, value: Value) -> None:
        self._deadline = int(value) * EVENT_UNIT
        self._alarm.stop()
        self._changed()

    def _act(self, data: bytes) -> None:
        if len(data) != self._length or self._length_error:
            self._judge_length(len(data))
            if len(data) < self._length:
                return
        values = self._unpack(data)
        for place, variable, may_fail in self._written:  # as `Variable.write`, three times a drive in every cycle
            value = values[place]
            try:
                if may_fail:
                    variable.check(value)
                if variable.on_write is not None:
                    variable.on_write(value)
                if variable.is_parameter:
                    variable.store(value)
                else:
                    variable.value = value
            except SdoAbort as refusal:
                # a PDO has no answer: the object keeps its value, the others of the frame are taken
                logger.debug("RPDO %d: %s refused: %s", self._number, value, refusal)

    def _judge_length(self, length: int) -> None:
        """Tell a wrong length once, and when it is right again (CiA 301, 7.2.2.5.1)."""
        error = PDO_TOO_SHORT if length < self._length else PDO_TOO_LONG if length > self._length else 0
        if error == self._length_error:
            return
        if self._length_error:
            self._emergency.clear_error(self._length_error, self._detail)
        self._length_error = error
        if error:
            self._emergency.raise_error(error, ErrorRegister.COMMUNICATION, self._detail)


def _commands_last(variables: Iterable[Variable]) -> list[tuple[int, Variable]]:
    """Mapped variables with their places; a controlword, which stands first by default, acts on what follows it."""
    return sorted(enumerate(variables), key=lambda entry: entry[1].is_command)
