"""One pair of copper that nodes share: a frame at a time, the lowest identifier first, and who does not fit waits."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

from drivetwin.copper.frame_bits import INTERMISSION, Frame, frame_bits

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

    Each node sends in the order in which it was handed its frames, as SocketCAN's queue does; between nodes the identifier
    arbitrates, and what is on the wire is never interrupted (ISO 11898-1). Queues have no end: what does not fit is late.
    """

    def __init__(self, bit_rate: int) -> None:
        """`bit_rate` in bit/s."""
        self.bit_rate = bit_rate
        self._queues: dict[int, deque[_Waiting]] = {}
        self._free = 0
        self._settled = 0

    def hand_in(self, sender: int, frame: Frame, at: float) -> None:
        """A node wants to send from the time `at` [s] on.

        Raises ValueError where `at` lies before the time up to which the wire was run, or before the node's last frame.
        """
        queue = self._queues.setdefault(sender, deque())
        since = round(at * NANOSECONDS)
        earliest = max(self._settled, queue[-1].since if queue else 0)
        if since < earliest:
            raise ValueError(
                f"{frame.identifier:03X}h of node {sender} is handed in at {at:.9f} s, but the wire has come to "
                f"{earliest / NANOSECONDS:.9f} s; hand frames in by their time"
            )
        queue.append(_Waiting(frame, since))

    def run(self, until: float) -> list[Transmission]:
        """The frames that start before `until` [s], in the order of the wire; `received` may be later.

        A frame that is handed in at `until` still takes part in the arbitration of that instant.
        """
        self._settled = max(self._settled, round(until * NANOSECONDS))
        done = []
        while self._waiting():
            start = max(self._free, min(queue[0].since for queue in self._queues.values() if queue))
            if start >= self._settled:
                break
            done.append(self._transmit(start))
        return done

    @property
    def backlog(self) -> int:
        """Frames that wait."""
        return sum(len(queue) for queue in self._queues.values())

    def _waiting(self) -> bool:
        return any(self._queues.values())

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
