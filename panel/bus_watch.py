"""What passes on the bus: frames with names, the load that they would make on a physical bus, and cycles that end late."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import can

from drivetwin.bus.timing.bit_rate import BIT_RATES
from drivetwin.bus.timing.frame_bits import Frame, frame_bits
from drivetwin.bus.timing.services import AT_LEISURE, SYNC, service
from drivetwin.foundation.errors import UserError
from drivetwin.panel.bus_time import BusTime
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


@dataclass
class Kind:
    """What was seen of one identifier."""

    count: int = 0
    bits: int = 0


class BusWatch:
    """`take` is called with every frame in the thread of the bus, `told` in that of the pages."""

    def __init__(self, nodes: Mapping[int, NodeWatch], time: BusTime) -> None:
        self._nodes = nodes
        self._time = time
        self._lock = threading.Lock()
        self._kinds: dict[int, Kind] = {}
        self._last: deque[Seen] = deque(maxlen=MOST_SHOWN)
        self._cycles: deque[tuple[float, dict[str, int]]] = deque(maxlen=MOST_CYCLES)
        self._filling: dict[str, int] = {}
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

    def take(self, message: can.Message) -> None:
        """A frame of the bus, after its time is known (`BusTime.take`)."""
        if message.is_extended_id or message.is_fd:
            return
        identifier, remote, data = message.arbitration_id, message.is_remote_frame, bytes(message.data)
        bits = frame_bits(Frame(identifier, b"" if remote else data, message.dlc if remote else None))
        name = service(identifier)
        with self._lock:
            if name == SYNC:
                self._next_cycle()
            self._filling[name] = self._filling.get(name, 0) + bits
            kind = self._kinds.setdefault(identifier, Kind())
            kind.count += 1
            kind.bits += bits
            self._last.append(Seen(self._time.now, identifier, remote, data))

    def _next_cycle(self) -> None:
        """A cycle is late whose frames, with what the one before left, need longer than it lasted; SDO, NMT, LSS give way."""
        now = self._time.now
        if self._began is not None and now > self._began:
            needed = sum(bits for name, bits in self._filling.items() if name not in AT_LEISURE)
            self._left = max(0.0, self._left + needed - self.bit_rate * (now - self._began))
            self.cycles += 1
            self.late += self._left > 0.0
            self._cycles.append((now - self._began, self._filling))
        self._began, self._filling = now, {}

    def told(self) -> dict[str, object]:
        """For the page."""
        with self._lock:
            last, cycles = list(self._last), list(self._cycles)
            kinds = {key: Kind(**vars(kind)) for key, kind in self._kinds.items()}
        seconds = sum(length for length, _ in cycles)
        by_service: dict[str, int] = {}
        for _, bits in cycles:
            for name, number in bits.items():
                by_service[name] = by_service.get(name, 0) + number
        full = self.bit_rate * seconds
        return {
            "bit_rate": self.bit_rate,
            "seconds": seconds,
            "load": sum(by_service.values()) / full if seconds else None,
            "worst": max((sum(bits.values()) / (self.bit_rate * length) for length, bits in cycles), default=None),
            "services": {name: bits / full for name, bits in sorted(by_service.items(), key=lambda one: -one[1])},
            "cycles": self.cycles,
            "late": self.late,
            "identifiers": [
                {"id": f"{key:03X}h", "name": self.name(key), "count": kind.count, "bits": kind.bits / kind.count}
                for key, kind in sorted(kinds.items())
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


def _short(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
