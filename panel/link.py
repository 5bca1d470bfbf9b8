"""The panel's end of the bus: one thread takes what passes and hands it on, many frames at once."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType

import can
import canopen
import numpy as np

from drivetwin.bus.unix_bus import UnixBus, pack
from drivetwin.foundation.errors import UserError
from drivetwin.panel.frames import Frames, Packet, frames_of

logger = logging.getLogger(__name__)

Hearer = Callable[[Frames], None]

TOGETHER = 0.03
"""So long frames are gathered before they are handed on [s], where nobody waits for an answer."""

REST = 0.005
"""Between two looks at what has come, where nobody waits [s]: to be woken by each packet costs more."""

BLINK = 0.001
"""Longest wait for a frame where somebody waits [s]: who asks next is not noticed meanwhile."""

WAIT = 0.1
"""Between two looks whether the panel has caught up with the bus, at most [s]."""

SDO_REQUESTS, SDO_ANSWERS = range(0x601, 0x680), range(0x581, 0x600)
"""COB-IDs of the default SDO channels (CiA 301, 7.3.5)."""


class Link(canopen.Network):
    """A canopen network on an open python-can bus. `hearers` get every frame, in the thread of the bus.

    `lost` says why the bus has gone, None while it is there.
    """

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self.hearers: list[Hearer] = []
        self.lost: str | None = None
        self._wire = bus
        self._receive = _receiver(bus)
        self._passed: deque[Packet] = deque()
        self._asked: dict[int, float] = {}
        self._unanswered: set[int] = set()
        self._urgent = 0
        self._woken = threading.Event()
        self._wants_to_catch_up = threading.Event()
        self._caught_up = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="panel bus", daemon=True)

    def __enter__(self) -> Link:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._ended.set()
        self._thread.join()
        self._wire.shutdown()

    @property
    def name(self) -> str:
        """Of the bus."""
        return str(self._wire.channel_info)

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Send one frame for canopen, as `Network.send_message`. Raises UserError where the bus has gone."""
        message = can.Message(arbitration_id=can_id, data=data, is_extended_id=can_id > 0x7FF, is_remote_frame=remote)
        try:
            with self.send_lock:
                self._wire.send(message)
                self._passed.append(Packet(time.time(), pack(message), own=True))
        except can.CanError as error:
            raise UserError(str(error)) from None

    def quiet_for(self, node_id: int) -> float:
        """Seconds since another master asked the node by SDO, as far as the panel has caught up with the bus."""
        return time.monotonic() - self._asked.get(node_id, 0.0)

    def is_unanswered(self, node_id: int) -> bool:
        """Whether the node owes another master an SDO answer."""
        return node_id in self._unanswered

    def catch_up(self, patience: float) -> bool:
        """Hear all that has passed by now; whether that took less than `patience` [s]: a loaded computer lags behind."""
        until = time.monotonic() + patience
        self._caught_up.clear()
        self._wants_to_catch_up.set()
        self._woken.set()
        while not self._caught_up.wait(WAIT):
            if time.monotonic() > until or self.lost is not None or self._ended.is_set():
                return False
        return True

    def hurry(self, hurries: bool) -> None:
        """Hand frames on as they come while somebody waits for an answer; one call with False for each with True."""
        with self.send_lock:
            self._urgent += 1 if hurries else -1
        self._woken.set()

    def _run(self) -> None:
        try:
            while not self._ended.is_set():
                self._gather()
                self._hand_on()
        except can.CanError as error:
            self.lost = str(error)

    def _gather(self) -> None:
        """What passes until it is time to hand it on; where somebody waits, until nothing more has come by now."""
        due = time.monotonic() + TOGETHER
        while (left := due - time.monotonic()) > 0.0:
            self._woken.wait(0.0 if self._urgent > 0 else min(REST, left))
            self._woken.clear()
            catches_up = self._wants_to_catch_up.is_set()
            packet = self._receive(min(left, BLINK) if self._urgent > 0 and not self._passed and not catches_up else 0.0)
            while packet is not None:
                self._passed.append(packet)
                packet = self._receive(0.0) if catches_up or time.monotonic() < due else None
            if catches_up:
                self._hand_on()
                self._wants_to_catch_up.clear()
                self._caught_up.set()
            elif self._urgent > 0 and self._passed:
                return

    def _hand_on(self) -> None:
        packets = [self._passed.popleft() for _ in range(len(self._passed))]
        if not packets:
            return
        frames = frames_of(packets)
        if not len(frames):
            return
        self._hear_sdo(frames)
        for identifier in frames.places:
            self.scanner.on_message_received(identifier)
        for hear in self.hearers:
            hear(frames)

    def _hear_sdo(self, frames: Frames) -> None:
        """Requests of other masters, and answers: to canopen."""
        of_sdo = (frames.identifiers >= SDO_ANSWERS.start) & (frames.identifiers < SDO_REQUESTS.stop)
        for place in np.flatnonzero(of_sdo & ~frames.own & ~frames.remote).tolist():
            identifier = int(frames.identifiers[place])
            if identifier in SDO_REQUESTS:
                self._asked[identifier - 0x600] = time.monotonic()
                self._unanswered.add(identifier - 0x600)
            elif identifier in SDO_ANSWERS:
                self._unanswered.discard(identifier - 0x580)
                self.notify(identifier, bytearray(frames.content(place)), float(frames.times[place]))


def _receiver(bus: can.BusABC) -> Callable[[float], Packet | None]:
    """Waits for what comes next, so long [s] at most. Raises CanError where the bus has gone."""
    if isinstance(bus, UnixBus):
        return lambda wait: _stamped(bus.recv_packet(wait))
    return lambda wait: _packet(bus.recv(wait))


def _stamped(came: tuple[float, bytes] | None) -> Packet | None:
    return None if came is None else Packet(*came)


def _packet(message: can.Message | None) -> Packet | None:
    """A frame with more than 8 bytes is no classic one, and comes as none."""
    if message is None:
        return None
    return Packet(message.timestamp, b"" if message.is_fd else pack(message))
