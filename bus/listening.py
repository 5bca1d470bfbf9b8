"""Whoever listens to a bus of others: every frame into a candump log, and drives asked by SDO where no master asks them."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TextIO

import can

from drivetwin.bus.candump import candump_line

REQUEST, ANSWER = 0x600, 0x580
"""COB-IDs of the default SDO channel, and the node-ID (CiA 301, 7.3.5)."""
UPLOAD, EXPEDITED = 0x40, 0x43
"""Command specifiers of an upload (CiA 301, 7.2.4.3.15)."""
QUIET = 0.1
"""So long no master has asked a drive by SDO before it is asked here [s]: it has one default channel."""
PATIENCE = 1.0
"""Longest wait for that, and for the answer [s]."""
SLICE = 0.1
"""Longest wait for a frame before looking whether to stop [s]."""
PDOS, ENTRIES = 4, 8
FACTORS = ((0x1006, 0), (0x608F, 1), (0x608F, 2), (0x6091, 1), (0x6091, 2), (0x6092, 1), (0x6092, 2), (0x6076, 0))
"""Cycle period, encoder, gear, feed and rated torque (CiA 301; CiA 402-2)."""


class Listener:
    """Hears `bus` and writes what it hears, and what it sends, to the candump log `path`.

    A frame has the time at which it came; where frames carry none, the time of day. `channel` is the bus's name in the log.
    """

    def __init__(
        self, bus: can.BusABC, path: Path, channel: str = "can0", now: Callable[[], float] = time.monotonic
    ) -> None:
        self.frames = 0
        self._bus = bus
        self._channel = channel
        self._now = now
        self._asked: dict[int, float] = {}
        self._stream: TextIO = path.open("w", encoding="ascii")

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def listen(self, seconds: float | None, ended: Callable[[], bool]) -> None:
        """Until `ended`, or for so long [s]."""
        until = None if seconds is None else self._now() + seconds
        while not ended() and (until is None or self._now() < until):
            self._hear(SLICE if until is None else min(SLICE, max(until - self._now(), 0.0)))

    def ask_scales(self, node: int, ended: Callable[[], bool]) -> bool:
        """Ask a drive for its factors and for what its PDOs carry, until `ended`; whether it answers at all, and its master
        lets it, as far as that was seen.

        The answers stand in the log, where an import finds them.
        """
        if self._ask(node, *FACTORS[0], ended) is None:
            return ended()
        for index, subindex in (*FACTORS[1:], *_communication()):
            self._ask(node, index, subindex, ended)
        for base in (0x1600, 0x1A00):
            for number in range(PDOS):
                count = self._ask(node, base + number, 0, ended) or 0
                for subindex in range(1, min(count, ENTRIES) + 1):
                    self._ask(node, base + number, subindex, ended)
        return True

    def _ask(self, node: int, index: int, subindex: int, ended: Callable[[], bool]) -> int | None:
        """The value of an object of up to four bytes; 0 where the drive has none.

        None where it does not answer, or a master never pauses, and once it is `ended`.
        """
        until = self._now() + PATIENCE
        while not ended() and self._now() < min(until, self._asked.get(node, -QUIET) + QUIET):
            self._hear(QUIET)
        if ended() or self._now() < self._asked.get(node, -QUIET) + QUIET:
            return None
        data = bytes([UPLOAD]) + struct.pack("<HB", index, subindex) + bytes(4)
        self._bus.send(request := can.Message(arbitration_id=REQUEST + node, data=data, is_extended_id=False))
        self._write(request)
        until = self._now() + PATIENCE
        while not ended() and (left := until - self._now()) > 0.0:
            heard = self._hear(min(left, SLICE))
            if heard is not None and heard.arbitration_id == ANSWER + node and bytes(heard.data[1:4]) == data[1:4]:
                answer = bytes(heard.data)
                size = 4 - (answer[0] >> 2 & 3) if answer[0] & 1 else 4
                return int.from_bytes(answer[4 : 4 + size], "little") if answer[0] & 0xE3 in (0x42, EXPEDITED) else 0
        return None

    def _hear(self, seconds: float) -> can.Message | None:
        message = self._bus.recv(seconds)
        if message is not None and not message.is_error_frame:
            self._write(message)
            if message.arbitration_id & ~0x7F == REQUEST:
                self._asked[message.arbitration_id & 0x7F] = self._now()
        return message

    def _write(self, message: can.Message) -> None:
        self.frames += 1
        requested = message.dlc if message.is_remote_frame else None
        stamp, data = message.timestamp or time.time(), bytes(message.data)
        self._stream.write(candump_line(stamp, self._channel, message.arbitration_id, data, requested, message.is_extended_id))


def _communication() -> Iterator[tuple[int, int]]:
    """COB-ID and transmission type of each PDO."""
    for base in (0x1400, 0x1800):
        for number in range(PDOS):
            yield base + number, 1
            yield base + number, 2
