"""The last samples of one channel: as much memory after an hour as after a minute."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float64]

CAPACITY = 60_000
"""Samples: a minute of 1 kHz."""


class Ring:
    """Times (n,) [s], rising, and values (n,), of which at least the last `capacity` are there."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._capacity = capacity
        self._times = np.full(2 * capacity, np.nan)  # written to, so that all memory is taken now and not as samples come
        self._values = np.full(2 * capacity, np.nan)
        self._count = 0
        self.last: float | None = None

    def extend(self, times: Samples, values: Samples) -> None:
        """More samples, `capacity` at most, of times that do not fall; those of an earlier time than the last are left out."""
        if self._count:
            first = int(np.searchsorted(times, self._times[self._count - 1]))
            times, values = times[first:], values[first:]
        if not times.size:
            return
        if self._count + times.size > 2 * self._capacity:
            kept = slice(self._count - self._capacity, self._count)
            self._times[: self._capacity] = self._times[kept]
            self._values[: self._capacity] = self._values[kept]
            self._count = self._capacity
        added = slice(self._count, self._count + times.size)
        self._times[added], self._values[added] = times, values
        self._count += times.size
        self.last = float(values[-1])

    def between(self, start: float, end: float) -> tuple[Samples, Samples]:
        """Times and values from `start` to `end` [s], both included, where they stand: they change with the next `extend`."""
        times = self._times[: self._count]
        first, beyond = np.searchsorted(times, start, "left"), np.searchsorted(times, end, "right")
        return times[first:beyond], self._values[first:beyond]
