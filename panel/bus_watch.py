"""What passes on the bus: frames with names, the load that they would make on a physical bus, and cycles that end late."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from drivetwin.bus.timing.bit_rate import BIT_RATES
from drivetwin.bus.timing.frame_bits import LARGEST_IDENTIFIER, all_frame_bits
from drivetwin.bus.timing.services import AT_LEISURE, OTHER, SERVICES, service
from drivetwin.foundation.errors import UserError
from drivetwin.panel.bus_time import SYNC as SYNC_IDENTIFIER
from drivetwin.panel.frames import Frames
from drivetwin.panel.node_watch import NodeWatch
from drivetwin.panel.values import Value

BIT_RATE = 1_000_000
"""What the load is measured against until somebody chooses another [bit/s]."""

MOST_SHOWN = 60
"""Frames of the list."""

MOST_CYCLES = 1000
"""Cycles that the load is taken over."""


@dataclass(frozen=True)
class Seen:
    """A frame as it passed; `time` [s] of the bus."""

    time: float
    identifier: int
    remote: bool
    data: bytes


_NAMES = [*(name for _, name in SERVICES), OTHER]
_IN_CYCLE = np.array([name not in AT_LEISURE for name in _NAMES])


class BusWatch:
    """`take` is called with the frames in the thread of the bus, `told` in that of the pages."""

    def __init__(self, nodes: Mapping[int, NodeWatch]) -> None:
        self._nodes = nodes
        self._lock = threading.Lock()
        self._counts = np.zeros(LARGEST_IDENTIFIER + 1, np.int64)
        self._bits = np.zeros(LARGEST_IDENTIFIER + 1, np.int64)
        self._last: deque[Seen] = deque(maxlen=MOST_SHOWN)
        self._cycles: deque[tuple[float, NDArray[np.int64]]] = deque(maxlen=MOST_CYCLES)
        self._filling = np.zeros(len(_NAMES), np.int64)
        self._began: float | None = None
        self._left = 0.0
        self.late = self.cycles = 0
        self.bit_rate = BIT_RATE

    def set_bit_rate(self, bit_rate: int) -> None:
        """Measure against this from now on [bit/s]. Raises UserError for what no CAN bus has."""
        if bit_rate not in BIT_RATES:
            raise UserError(f"{bit_rate} bit/s is no bit rate of a classic CAN bus; expected {BIT_RATES[0]} to {BIT_RATES[-1]}")
        with self._lock:
            self.bit_rate = bit_rate
            self.late, self.cycles, self._left = 0, 0, 0.0

    def take(self, frames: Frames) -> None:
        """Frames of the bus, by its time."""
        bits = all_frame_bits(frames.identifiers, frames.lengths, frames.data, frames.remote)
        syncs = np.flatnonzero(frames.identifiers == SYNC_IDENTIFIER)
        parts = np.zeros(len(frames), np.int64)
        parts[syncs] = 1
        by_part = np.zeros((len(syncs) + 1, len(_NAMES)), np.int64)
        np.add.at(by_part, (np.cumsum(parts), _services()[frames.identifiers]), bits)
        with self._lock:
            self._filling += by_part[0]
            for began, filling in zip(frames.times[syncs].tolist(), by_part[1:], strict=True):
                self._next_cycle(began, filling)
            self._counts += np.bincount(frames.identifiers, minlength=LARGEST_IDENTIFIER + 1)
            np.add.at(self._bits, frames.identifiers, bits)
            for place in range(max(0, len(frames) - MOST_SHOWN), len(frames)):
                identifier, remote = int(frames.identifiers[place]), bool(frames.remote[place])
                self._last.append(Seen(float(frames.times[place]), identifier, remote, frames.content(place)))

    def _next_cycle(self, now: float, filling: NDArray[np.int64]) -> None:
        """A cycle is late whose frames, with what the one before left, need longer than it lasted; SDO, NMT, LSS give way."""
        if self._began is not None and now > self._began:
            needed = int(self._filling[_IN_CYCLE].sum())
            self._left = max(0.0, self._left + needed - self.bit_rate * (now - self._began))
            self.cycles += 1
            self.late += self._left > 0.0
            self._cycles.append((now - self._began, self._filling))
        self._began, self._filling = now, filling

    def told(self) -> dict[str, object]:
        """For the page."""
        with self._lock:
            last, cycles = list(self._last), list(self._cycles)
            counts, bits = self._counts.copy(), self._bits.copy()
        seconds = sum(length for length, _ in cycles)
        totals = np.sum([each for _, each in cycles], axis=0).tolist() if cycles else []
        by_service = {name: number for name, number in zip(_NAMES, totals, strict=False) if number}
        full = self.bit_rate * seconds
        return {
            "bit_rate": self.bit_rate,
            "seconds": seconds,
            "load": sum(by_service.values()) / full if seconds else None,
            "worst": max((int(each.sum()) / (self.bit_rate * length) for length, each in cycles), default=None),
            "services": {name: number / full for name, number in sorted(by_service.items(), key=lambda one: -one[1])},
            "cycles": self.cycles,
            "late": self.late,
            "identifiers": [
                {"id": f"{key:03X}h", "name": self.name(key), "count": int(counts[key]), "bits": float(bits[key] / counts[key])}
                for key in np.flatnonzero(counts).tolist()
            ],
            "frames": [self._frame(seen) for seen in reversed(last)],
        }

    def name(self, identifier: int) -> str:
        """Service and drive, by the predefined connection set; a PDO by whoever's mapping has it."""
        for node in list(self._nodes.values()):
            if (pdo := node.pdos.get(identifier)) is not None:
                return f"{'TPDO' if pdo.transmits else 'RPDO'} of {node.name}"
        node_id, named = identifier & 0x7F, service(identifier)
        return f"{named} of {self._nodes[node_id].name}" if node_id in self._nodes and identifier != 0x7E5 else named

    def _frame(self, seen: Seen) -> dict[str, object]:
        data = "remote" if seen.remote else seen.data.hex(" ")
        told = {"time": seen.time, "id": f"{seen.identifier:03X}h", "name": self.name(seen.identifier), "data": data}
        return {**told, "values": self._values(seen)}

    def _values(self, seen: Seen) -> str:
        """What a PDO carries, by name."""
        for node in list(self._nodes.values()):
            if (pdo := node.pdos.get(seen.identifier)) is not None:
                return ", ".join(f"{node.entries[address].name} {_short(value)}" for address, value in pdo.values(seen.data))
        return ""


@cache
def _services() -> NDArray[np.intp]:
    """The place in `_NAMES` of each identifier's service."""
    return np.array([_NAMES.index(service(identifier)) for identifier in range(LARGEST_IDENTIFIER + 1)])


def _short(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
