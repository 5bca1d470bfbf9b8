"""The time of what is seen on a bus: of an emulated machine what its SYNCs have moved it by, of a real one the computer's."""

from __future__ import annotations

import numpy as np

from drivetwin.panel.frames import Frames, Samples
from drivetwin.panel.pdo_reading import Address

SYNC = 0x80
"""Its COB-ID by default (CiA 301, 7.3.3)."""

DEFAULT_CYCLE = 1000
"""What a SYNC moves an emulated machine by where 1006h is 0 [µs]."""

_CYCLE_PERIOD = (0x1006, 0)

_WRITES_CYCLE = bytes((0x23, 0x06, 0x10, 0x00))
"""Head of the expedited download of 1006h (CiA 301, 7.2.4.3.3)."""


class BusTime:
    """`now` [s] rises from 0. `paced_by`: the node whose 1006h a SYNC of the emulated machine is; None: the frames' stamps."""

    def __init__(self, paced_by: int | None) -> None:
        self.now = 0.0
        self._cycle = DEFAULT_CYCLE
        self._micros = 0
        self._paced_by = paced_by
        self._began: float | None = None

    def of(self, frames: Frames) -> Samples:
        """When each of the next frames passed (n,) [s], before anybody else hears them. Their own times are the computer's."""
        times = self._by_stamps(frames) if self._paced_by is None else self._by_syncs(frames, self._paced_by)
        self.now = float(times[-1])
        return times

    def written(self, address: Address, data: bytes) -> None:
        """The panel has written an object of the node that paces, beside the bus."""
        if address == _CYCLE_PERIOD:
            self._cycle = int.from_bytes(data, "little") or DEFAULT_CYCLE

    def _by_stamps(self, frames: Frames) -> Samples:
        self._began = float(frames.times[0]) if self._began is None else self._began
        return np.maximum.accumulate(np.maximum(frames.times - self._began, self.now))

    def _by_syncs(self, frames: Frames, paced_by: int) -> Samples:
        steps = np.zeros(len(frames), np.int64)
        syncs = frames.of(SYNC)
        steps[syncs] = self._cycle
        for place, cycle in self._changes(frames, paced_by):
            self._cycle = cycle
            steps[syncs[syncs > place]] = cycle
        micros = self._micros + np.cumsum(steps)
        self._micros = int(micros[-1])
        return np.asarray(1e-6 * micros)

    def _changes(self, frames: Frames, paced_by: int) -> list[tuple[int, int]]:
        """Where the cycle becomes another one [µs]: a master writes it, or the node boots."""
        requests = [(place, frames.content(place)) for place in frames.of(0x600 + paced_by).tolist()]
        writes = [(place, data[4:]) for place, data in requests if data[:4] == _WRITES_CYCLE]
        told = [(place, int.from_bytes(data, "little") or DEFAULT_CYCLE) for place, data in writes]
        boots = [place for place in frames.of(0x700 + paced_by).tolist() if frames.content(place) == b"\0"]
        return sorted([*told, *((place, DEFAULT_CYCLE) for place in boots)])
