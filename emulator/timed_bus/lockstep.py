"""Bit timing in lockstep: a cycle of the wire is a cycle of the plant, and frames that do not fit come later."""

from __future__ import annotations

import logging
from collections.abc import Callable

import can

from drivetwin.bus.timing.services import AT_LEISURE, service
from drivetwin.bus.timing.wire import Transmission
from drivetwin.emulator.timed_bus.bus import TimedBus, Watch, nobody
from drivetwin.emulator.virtual_machine import VirtualMachine

logger = logging.getLogger(__name__)

NANOSECOND_DIGITS = 9
"""Of seconds: the beat is in whole nanoseconds, as the wire's time is."""


class LockstepBus(TimedBus):
    """Gives, at a SYNC, the frames that are whole before the next SYNC is due, and holds the others back until that comes.

    - The controller's synchronous RPDOs, and what it sends after them without waiting for an answer, wait for its SYNC; then it
      hands them in in its order, when the cycle begins. The drives sample, and send, when SYNC is whole.
    - A cycle begins one communication cycle after the last one, or when what came between the SYNCs is over, if that is later.
    - Anything else (SDO, NMT, ...) is on the wire at once, and time goes on until the wire is idle, as its sender may wait for
      an answer: it takes time of its cycle, and the next SYNC is late by what does not fit.
    - What comes of a cycle of the plant (statusword, EMCY, heartbeat) is handed in when the cycle is over.

    `late_frames` were not whole when the cycle in which they were handed in was over; the longest took `worst_delay` [s].
    """

    def __init__(
        self,
        bit_rate: int,
        connect: Callable[[Callable[[can.Message], None]], VirtualMachine],
        transmit: Callable[[can.Message], None],
        watch: Watch = nobody,
    ) -> None:
        super().__init__(bit_rate, connect, transmit, watch)
        self.late_frames = 0
        self.worst_delay = 0.0
        self._waiting_for_sync: list[can.Message] = []
        self._began = 0.0
        self._due = 0.0

    def poll(self) -> None:
        self.virtual.poll()
        self._go_on_unasked()

    def wait(self) -> float | None:
        return self.virtual.wait()

    def _take(self, message: can.Message) -> None:
        self._go_on_unasked()
        if self._is_sync(message):
            self._run_cycle(message)
        elif self._waits_for_sync(message) or (self._waiting_for_sync and not _may_be_answered(message)):
            self._waiting_for_sync.append(message)
        else:
            self._hand_in(message, self._line.time)
            self._line.run_until_idle(self._line.time)

    def _run_cycle(self, sync: can.Message) -> None:
        self._began = max(self._due, self._line.time)
        self._due = round(self._began + self.virtual.cycle(), NANOSECOND_DIGITS)
        self._hand_in(sync, self._began)
        self._line.run(self._due)

    def _hand_in(self, message: can.Message, at: float) -> None:
        """A frame of the controller, behind those that are still with it."""
        for earlier in self._waiting_for_sync:
            self._line.send(earlier, at)
        self._waiting_for_sync.clear()
        self._line.send(message, at)

    def _go_on_unasked(self) -> None:
        """What the machine does by itself: it runs on without SYNC, or a fault has struck."""
        moved = self._line.moved()
        if moved == 0.0 and not self._line.unasked:
            return
        begin = self._line.time if moved == 0.0 else max(self._due, self._line.time)
        self._due = max(self._due, begin + moved)
        self._line.send_unasked(begin)
        self._line.run_until_idle(begin + moved)

    def _is_sync(self, message: can.Message) -> bool:
        return message.arbitration_id == self.virtual.drives[0].device.sync_cob_id and not message.is_remote_frame

    def _waits_for_sync(self, message: can.Message) -> bool:
        pdos = (rpdo.parameters for drive in self.virtual.drives for rpdo in drive.device.rpdos)
        return any(pdo.cob_id == message.arbitration_id and pdo.active and pdo.synchronous for pdo in pdos)

    def _whole(self, whole: Transmission) -> None:
        if whole.handed_in < self._began:
            if not self.late_frames:
                logger.warning("%s", self._does_not_fit(whole))
            self.late_frames += 1
            self.worst_delay = max(self.worst_delay, whole.delay)
        super()._whole(whole)

    def _does_not_fit(self, whole: Transmission) -> str:
        late = whole.received - self._began
        return (
            f"{whole.frame.identifier:03X}h came {1e6 * late:.0f} us after its cycle of {1e3 * self.virtual.cycle():g} ms was "
            f"over: the frames do not fit into it at {1e-3 * self._line.bit_rate:g} kbit/s (reported once)"
        )


def _may_be_answered(message: can.Message) -> bool:
    """Whether its sender may wait for an answer, before which it sends no SYNC."""
    return message.is_remote_frame or service(message.arbitration_id) in AT_LEISURE
