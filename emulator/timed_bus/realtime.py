"""Bit timing on the wall clock: a frame is delivered when its last bit would have been sent."""

from __future__ import annotations

import time
from collections.abc import Callable

import can

from drivetwin.emulator.timed_bus.bus import TimedBus, Watch, nobody
from drivetwin.emulator.virtual_machine import VirtualMachine


class RealtimeBus(TimedBus):
    """Frames are handed in when they come, and given by the first `poll` after they are whole."""

    def __init__(
        self,
        bit_rate: int,
        connect: Callable[[Callable[[can.Message], None]], VirtualMachine],
        transmit: Callable[[can.Message], None],
        watch: Watch = nobody,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """As `TimedBus`; `now` is the wall clock [s]."""
        super().__init__(bit_rate, connect, transmit, watch)
        self._wall = now
        self._began = now()

    def poll(self) -> None:
        self.virtual.poll()
        self._line.send_unasked(self._now() - self._line.moved())
        self._line.run(self._now())

    def wait(self) -> float | None:
        pause, event = self.virtual.wait(), self._line.next_event()
        if event is None:
            return pause
        until = max(0.0, event - self._now())
        return until if pause is None else min(pause, until)

    def _take(self, message: can.Message) -> None:
        self._line.send(message, self._now())

    def _now(self) -> float:
        """On the wire [s]."""
        return self._wall() - self._began
