"""The time of what is seen on a bus: of an emulated machine what its SYNCs have moved it by, of a real one the computer's."""

from __future__ import annotations

import can

SYNC = 0x80
"""Its COB-ID by default (CiA 301, 7.3.3)."""

DEFAULT_CYCLE = 1000
"""What a SYNC moves an emulated machine by where 1006h is 0 [µs]."""

_WRITES_CYCLE = bytes((0x23, 0x06, 0x10, 0x00))
"""Head of the expedited download of 1006h (CiA 301, 7.2.4.3.3)."""


class BusTime:
    """`now` [s] rises from 0. `paced_by`: the node whose 1006h a SYNC of the emulated machine is; None: the frames' stamps."""

    def __init__(self, paced_by: int | None) -> None:
        self.now = 0.0
        self.syncs = 0
        self._cycle = DEFAULT_CYCLE
        self._micros = 0
        self._paced_by = paced_by
        self._began: float | None = None

    def take(self, message: can.Message) -> None:
        """A frame of the bus, before anybody else hears it."""
        if message.arbitration_id == SYNC:
            self.sync()
        if self._paced_by is None:
            self._began = message.timestamp if self._began is None else self._began
            self.now = max(self.now, message.timestamp - self._began)
        elif message.arbitration_id == 0x600 + self._paced_by and bytes(message.data[:4]) == _WRITES_CYCLE:
            self._cycle = int.from_bytes(message.data[4:8], "little") or DEFAULT_CYCLE
        elif message.arbitration_id == 0x700 + self._paced_by and bytes(message.data) == b"\0":
            self._cycle = DEFAULT_CYCLE

    def sync(self) -> None:
        """A SYNC passed, somebody else's or the panel's own."""
        self.syncs += 1
        if self._paced_by is not None:
            self._micros += self._cycle
            self.now = 1e-6 * self._micros
