"""The physical bus that nodes share: one frame at a time, lowest identifier first; every other frame waits."""

from __future__ import annotations

from bisect import insort
from collections import deque
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

from drivetwin.bus.timing.frame_bits import INTERMISSION, Frame, frame_bits

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Transmission:
    """A frame's way: handed to its node's CAN controller, on the wire from `start`, whole at every node when `received` [s]."""

    sender: int
    frame: Frame
    handed_in: float
    start: float
    received: float

    @property
    def delay(self) -> float:
        """From handing in to reception [s]."""
        return self.received - self.handed_in


class _Waiting(NamedTuple):
    """A frame in a node's queue; times in whole nanoseconds, so that equal instants are equal."""

    frame: Frame
    since: int


class Wire:
    """A wire of one bit rate, without errors.

    Each node sends in the order of the times at which it was handed its frames, as SocketCAN's queue does; between nodes the
    identifier arbitrates, and what is on the wire is never interrupted (ISO 11898-1). Queues have no end: what does not fit is
    late.
    """

    def __init__(self, bit_rate: int) -> None:
        """`bit_rate` in bit/s."""
        self.bit_rate = bit_rate
        self._queues: dict[int, deque[_Waiting]] = {}
        self._free = 0
        self._settled = 0

    def hand_in(self, sender: int, frame: Frame, at: float) -> None:
        """A node wants to send from the time `at` [s] on; of frames with equal times the one handed in first goes first.

        Raises ValueError where `at` lies before the time up to which the wire was run.
        """
        since = round(at * NANOSECONDS)
        if since < self._settled:
            raise ValueError(
                f"{frame.identifier:03X}h of node {sender} is handed in at {at:.9f} s, but the wire has come to "
                f"{self.settled:.9f} s; hand frames in by their time"
            )
        insort(self._queues.setdefault(sender, deque()), _Waiting(frame, since), key=attrgetter("since"))

    def run(self, until: float) -> list[Transmission]:
        """The frames that start before `until` [s], in the order of the wire; `received` may be later.

        A frame that is handed in at `until` still takes part in the arbitration of that instant.
        """
        done = []
        while (sent := self.step(until)) is not None:
            done.append(sent)
        self._settled = max(self._settled, round(until * NANOSECONDS))
        return done

    def step(self, until: float) -> Transmission | None:
        """The next frame, if it starts before `until` [s]; who answers it hands in the answer before the next step."""
        start = self._next_start()
        if start is None or start > until * NANOSECONDS - 0.5:  # equal in whole nanoseconds is not before
            return None
        self._settled = start + 1
        return self._transmit(start)

    @property
    def settled(self) -> float:
        """The time up to which the wire was run [s]: no frame can be handed in before it."""
        return self._settled / NANOSECONDS

    @property
    def free(self) -> float:
        """When the last frame and its intermission are over [s]."""
        return self._free / NANOSECONDS

    @property
    def next_start(self) -> float | None:
        """When the next frame starts, if no other is handed in before [s]; None where nothing waits."""
        start = self._next_start()
        return None if start is None else start / NANOSECONDS

    @property
    def backlog(self) -> int:
        """Frames that wait."""
        return sum(len(queue) for queue in self._queues.values())

    def _next_start(self) -> int | None:
        """[ns]."""
        first = min((queue[0].since for queue in self._queues.values() if queue), default=None)
        return None if first is None else max(self._free, first)

    def _transmit(self, start: int) -> Transmission:
        """Let the winner of the arbitration at `start` [ns] have the wire."""
        contenders = {node: queue[0] for node, queue in self._queues.items() if queue and queue[0].since <= start}
        sender = min(contenders, key=lambda node: (contenders[node].frame.identifier, contenders[node].frame.rtr))
        frame, since = self._queues[sender].popleft()
        bits = frame_bits(frame)
        self._free = start + self._duration(bits)
        received = start + self._duration(bits - INTERMISSION)
        return Transmission(sender, frame, since / NANOSECONDS, start / NANOSECONDS, received / NANOSECONDS)

    def _duration(self, bits: int) -> int:
        """[ns]."""
        return round(bits * NANOSECONDS / self.bit_rate)
