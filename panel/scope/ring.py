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

    def append(self, time: float, value: float) -> None:
        """One more sample; one of an earlier time than the last is left out."""
        count = self._count
        if count and time < self._times[count - 1]:
            return
        if count == 2 * self._capacity:
            self._times[: self._capacity] = self._times[self._capacity :]
            self._values[: self._capacity] = self._values[self._capacity :]
            count = self._capacity
        self._times[count], self._values[count] = time, value
        self._count = count + 1
        self.last = value

    def between(self, start: float, end: float) -> tuple[Samples, Samples]:
        """Copies of the times and values from `start` to `end` [s], both included."""
        times = self._times[: self._count]
        first, beyond = np.searchsorted(times, start, "left"), np.searchsorted(times, end, "right")
        return times[first:beyond].copy(), self._values[first:beyond].copy()
