"""How a node sees that others are there: the heartbeat consumer (CiA 301, 7.2.8.3.2.2, 1016h)."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.emergency import GUARDING, Emergency, ErrorRegister
from drivetwin.emulator.canopen.error_behaviour import ErrorBehaviour
from drivetwin.emulator.canopen.heartbeat import BASE_COB_ID, MILLISECOND
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary, Variable

NODE_IDS = range(1, 128)


class HeartbeatConsumer:
    """The watches that 1016h describes; a drive type without 1016h has none. `changed` is called after each change."""

    def __init__(
        self,
        od: ObjectDictionary,
        emergency: Emergency,
        behaviour: ErrorBehaviour,
        now: Callable[[], float],
        alarms: Alarms,
        changed: Callable[[], None],
    ) -> None:
        self._changed = changed
        count = od[0x1016].number if 0x1016 in od else 0
        self._watches = [
            _Watch(od[0x1016, subindex], emergency, behaviour, now, alarms) for subindex in range(1, count + 1)
        ]
        for watch in self._watches:
            watch.parameter.on_write = lambda value, watch=watch: self._write(watch, value)

    @property
    def handlers(self) -> dict[int, Callable[[bytes], None]]:
        """What to do with the heartbeat of each node that is watched, by CAN-ID."""
        return {BASE_COB_ID + watch.node_id: watch.receive for watch in self._watches if watch.active}

    def load(self) -> None:
        """Begin anew with 1016h as it stands: each node is watched from its first heartbeat on."""
        for watch in self._watches:
            watch.begin(watch.parameter.number)

    def _write(self, watch: _Watch, value: Value) -> None:
        others = {other.node_id for other in self._watches if other is not watch and other.active}
        node_id, time = int(value) >> 16 & 0xFF, int(value) & 0xFFFF
        if node_id in others and time:
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)
        watch.begin(int(value))
        self._changed()


class _Watch:
    """One entry of 1016h: node-ID in bits 16..23, heartbeat time [ms] in bits 0..15; unused where either is 0."""

    def __init__(
        self,
        parameter: Variable,
        emergency: Emergency,
        behaviour: ErrorBehaviour,
        now: Callable[[], float],
        alarms: Alarms,
    ) -> None:
        self.parameter = parameter
        self._emergency = emergency
        self._behaviour = behaviour
        self._now = now
        self._alarm = alarms.add(self._tell_missing)
        self._is_missing = False
        self.begin(0)

    @property
    def active(self) -> bool:
        """Whether a node is to be watched."""
        return self._time > 0.0 and self.node_id in NODE_IDS

    def begin(self, value: int) -> None:
        """Watch what `value` says, from its first heartbeat on."""
        self.node_id = value >> 16 & 0xFF
        self._detail = bytes((self.node_id, 0, 0, 0, 0))
        self._time = (value & 0xFFFF) * MILLISECOND
        self._is_missing = False
        self._alarm.stop()

    def receive(self, data: bytes) -> None:
        """A heartbeat, or the boot-up message, of the node."""
        if len(data) != 1:
            return
        self._alarm.set(self._now() + self._time)
        if self._is_missing:
            self._is_missing = False
            self._emergency.clear_error(GUARDING, self._detail)

    def _tell_missing(self, _now: float) -> None:
        self._is_missing = True
        self._emergency.raise_error(GUARDING, ErrorRegister.COMMUNICATION, self._detail)
        self._behaviour.communication_error(GUARDING)
