"""How the node says that something is wrong: EMCY, 1001h and 1003h (CiA 301, 7.2.7, 7.5.2.2, 7.5.2.4)."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from enum import IntFlag
from functools import partial
from math import inf

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.can_identifier import CAN_ID, INVALID, check_change, check_cob_id, exists
from drivetwin.emulator.canopen.data_types import Value
from drivetwin.emulator.canopen.nmt import Nmt
from drivetwin.emulator.canopen.object_dictionary import ObjectDictionary
from drivetwin.emulator.canopen.timing import TOLERANCE

NO_ERROR = 0x0000
COMMUNICATION = 0x8100
"""Communication, generic (CiA 301, table 26)."""
ERROR_PASSIVE = 0x8120
"""CAN in error passive mode (CiA 301, table 26)."""
GUARDING = 0x8130
"""Life guard error or heartbeat error (CiA 301, table 26)."""
BUS_OFF_RECOVERED = 0x8140
"""Recovered from bus off (CiA 301, table 26)."""
PDO_TOO_SHORT = 0x8210
"""PDO not processed due to length error (CiA 301, table 26)."""
PDO_TOO_LONG = 0x8220
"""PDO length exceeded (CiA 301, table 26)."""
SYNC_LENGTH = 0x8240
"""Unexpected SYNC data length (CiA 301, table 26)."""
RPDO_TIME_OUT = 0x8250
"""An RPDO did not come within its event timer (CiA 301, table 26)."""

INHIBIT_UNIT = 100e-6
NO_DETAIL = bytes(5)
LONGEST_QUEUE = 64
"""EMCYs that may wait for the inhibit time; of more, the oldest are lost."""

_FRAME = struct.Struct("<HB5s")


class ErrorRegister(IntFlag):
    """Bits of 1001h (CiA 301, 7.5.2.2)."""

    GENERIC = 0x01
    CURRENT = 0x02
    VOLTAGE = 0x04
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    DEVICE_PROFILE = 0x20
    MANUFACTURER = 0x80


class Emergency:
    """EMCY producer of one node, with the errors that are present and the list of past ones.

    Within the inhibit time (1015h) after an EMCY the next ones wait, in their order.
    """

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
        self._inhibit_time = od.get(0x1015)
        self._inhibited_until = -inf
        self._waiting: deque[bytes] = deque(maxlen=LONGEST_QUEUE)
        self._alarm = alarms.add(self._send_waiting)
        self._cob_id = od[0x1014]
        self._cob_id.on_write = self._check_cob_id
        self._present: dict[tuple[int, bytes], int] = {}
        self._history: deque[int] = deque(maxlen=max(sum(1 for variable in od if variable.index == 0x1003) - 1, 0))
        od[0x1001].on_read = lambda: self.register
        self._publish_history(od)

    @property
    def register(self) -> int:
        """1001h: the bits of all errors that are present; the generic bit with any of them."""
        bits = 0
        for error_bits in self._present.values():
            bits |= error_bits | ErrorRegister.GENERIC
        return int(bits)

    def raise_error(self, code: int, register_bits: int, manufacturer: bytes = NO_DETAIL) -> None:
        """Send EMCY `code` (CiA 301 table 26, CiA 402-2) with 1001h and 5 manufacturer bytes; keep it in 1003h."""
        self._present[code, manufacturer] = register_bits
        self._history.appendleft(code | int.from_bytes(manufacturer[:2], "little") << 16)
        self._send(code, manufacturer)

    def tells(self, code: int) -> bool:
        """Whether an error with that code is present, whatever its manufacturer bytes."""
        return any(present == code for present, _ in self._present)

    def clear(self) -> None:
        """All errors are gone: tell 'error reset or no error', if there was one."""
        if self._present:
            self._present.clear()
            self._send(NO_ERROR, NO_DETAIL)

    def clear_error(self, code: int, manufacturer: bytes = NO_DETAIL) -> None:
        """One error, as it was raised, is gone; 1001h in the frame tells what remains (CiA 301, 7.2.7.1)."""
        if self._present.pop((code, manufacturer), None) is not None:
            self._send(NO_ERROR, NO_DETAIL)

    def reset(self) -> None:
        """Forget present and past errors, as a power cycle does."""
        self._present.clear()
        self._history.clear()
        self.forget_waiting()

    def forget_waiting(self) -> None:
        """Send nothing of what still waits: communication begins anew."""
        self._waiting.clear()
        self._alarm.stop()
        self._inhibited_until = -inf

    def _send(self, code: int, manufacturer: bytes) -> None:
        frame = _FRAME.pack(code, self.register, manufacturer)
        if self._now() < self._inhibited_until:
            self._waiting.append(frame)
            self._alarm.set(self._inhibited_until)
        else:
            self._transmit_now(frame)

    def _send_waiting(self, _now: float) -> None:
        self._transmit_now(self._waiting.popleft())
        if self._waiting:
            self._alarm.set(self._inhibited_until)

    def _transmit_now(self, frame: bytes) -> None:
        cob_id = self._cob_id.number
        if not self._nmt.communicating or not exists(cob_id):
            return
        self._transmit(cob_id & CAN_ID, frame)
        if self._inhibit_time is not None and self._inhibit_time.number:
            self._inhibited_until = self._now() + self._inhibit_time.number * INHIBIT_UNIT - TOLERANCE

    def _check_cob_id(self, value: Value) -> None:
        check_cob_id(int(value) & ~INVALID)
        if int(value) & ~INVALID & ~CAN_ID:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        check_change(self._cob_id.number, int(value))

    def _publish_history(self, od: ObjectDictionary) -> None:
        count = od[0x1003, 0]
        count.on_read = lambda: len(self._history)
        count.on_write = self._clear_history
        for subindex in range(1, (self._history.maxlen or 0) + 1):
            od[0x1003, subindex].on_read = partial(self._past_error, subindex)

    def _past_error(self, subindex: int) -> int:
        if subindex > len(self._history):
            raise SdoAbort(AbortCode.NO_DATA)
        return self._history[subindex - 1]

    def _clear_history(self, value: Value) -> None:
        if value != 0:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self._history.clear()
