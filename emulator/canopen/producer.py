"""What a node sends at equal steps of time, for all nodes: the producers of SYNC and TIME (CiA 301, 7.2.5 and 7.2.6)."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.emulator.canopen.alarms import Alarms
from drivetwin.emulator.canopen.nmt import Nmt

Produce = Callable[[int, bytes], None]
"""Takes CAN-ID and data of a frame that is meant for all nodes, the one that sends it among them."""


class Producer:
    """Sends what `frame` gives every `period` seconds while the node is pre-operational or operational (CiA 301, 7.3.2.2.5)."""

    def __init__(
        self, nmt: Nmt, produce: Produce, now: Callable[[], float], alarms: Alarms, frame: Callable[[], tuple[int, bytes]]
    ) -> None:
        self._nmt = nmt
        self._produce = produce
        self._now = now
        self._alarm = alarms.add(self._send)
        self._frame = frame
        self._period = 0.0
        self._due = 0.0

    def run(self, period: float) -> None:
        """Begin anew with a period [s]; 0: send nothing."""
        self._period = period
        self._alarm.stop()
        if period:
            self._due = self._now() + period
            self._alarm.set(self._due)

    def _send(self, now: float) -> None:
        """It is time; periods that were missed altogether are not made up."""
        if self._nmt.communicating:
            self._produce(*self._frame())
        self._due += self._period
        if self._due <= now:
            self._due = now + self._period
        self._alarm.set(self._due)
