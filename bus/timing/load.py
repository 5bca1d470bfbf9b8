"""Bus load: the bits in any interval of time, and the cycles that ask for more bits than the bus can carry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from drivetwin.bus.timing.frame_bits import Frame, frame_bits
from drivetwin.bus.timing.services import AT_LEISURE, SYNC, service

MICROSECONDS = 1_000_000


@dataclass(frozen=True)
class LoggedFrame:
    """A frame and its time stamp in whole microseconds, as a candump log has it: equal instants are equal."""

    stamp: int
    frame: Frame


@dataclass(frozen=True)
class Window:
    """A stretch of time [`start`, `start` + `length`) [s], with the bits of the frames stamped in it, by service."""

    start: float
    length: float
    frames: int
    bits: int
    by_service: dict[str, int]

    def load(self, bit_rate: int) -> float:
        """Share of what a wire of `bit_rate` [bit/s] carries in this time; above 1 it is more than that."""
        return self.bits / (bit_rate * self.length)


@dataclass(frozen=True)
class Overruns:
    """The SYNC cycles whose frames were not over when the next SYNC was due, and the longest lateness of one."""

    cycles: int
    overrun: int
    latest: float
    """[s]; 0 where no cycle overran."""
    at: float
    """The SYNC that began the latest one [s]."""
    period: float
    """Median of the cycles [s]."""


class Load:
    """The bits of a log. Frames are stamped in order of time, all of one wire."""

    def __init__(self, frames: Sequence[LoggedFrame]) -> None:
        """Raises ValueError where no time passes from first to last frame, or a stamp is before that of the frame before."""
        self._stamps = np.array([logged.stamp for logged in frames], dtype=np.int64)
        if len(frames) == 0 or self._stamps[0] == self._stamps[-1]:
            raise ValueError(f"{len(frames)} frames with no time between them; a load needs a log that lasts")
        if (back := np.flatnonzero(np.diff(self._stamps) < 0)).size:
            before, after = self._stamps[back[0] : back[0] + 2] / MICROSECONDS
            raise ValueError(f"a frame stamped {after:.6f} s follows one of {before:.6f} s; frames have to be in order of time")
        self._bits = np.array([frame_bits(logged.frame) for logged in frames], dtype=np.int64)
        self._services = np.array([_service(logged.frame.identifier) for logged in frames])

    def whole(self) -> Window:
        """All frames, from the first stamp to the last, and one mean distance of stamps more: the time of the last frames."""
        span = int(self._stamps[-1] - self._stamps[0])
        distances = int(np.count_nonzero(np.diff(self._stamps)))
        return self._window(0, len(self._stamps), span + span / distances, frozenset())

    def worst(self, length: float, without: frozenset[str] = frozenset()) -> Window:
        """The window of `length` [s] with most bits, the first of equals, where services `without` count as silent.

        A frame counts whole where its stamp lies. Only windows that begin at a frame are tried: any other has no more than that
        of its first frame.
        """
        span = round(length * MICROSECONDS)
        sums = _sums(self._counted(without))
        ends = np.searchsorted(self._stamps, self._stamps + span, side="left")
        first = int(np.argmax(sums[ends] - sums[:-1]))
        return self._window(first, int(ends[first]), span, without)

    def overruns(self, bit_rate: int) -> Overruns | None:
        """Each SYNC cycle's bits against its time, where what was left over goes into the next; None with less than two SYNCs.

        A cycle is the frames stamped from one SYNC to before the next. Services that wait (SDO, NMT, LSS) give way and are left
        out: on the wire one of their frames can still be in the way, 135 bits at most.
        """
        syncs = self._stamps[self._services == SYNC]
        if len(syncs) < 2:
            return None
        needed = np.diff(_sums(self._counted(AT_LEISURE))[np.searchsorted(self._stamps, syncs, side="left")])
        given = np.diff(syncs)
        late = _carried(needed * MICROSECONDS - given * bit_rate)
        worst = int(np.argmax(late))
        return Overruns(
            cycles=len(given),
            overrun=int(np.count_nonzero(late)),
            latest=float(late[worst] / (MICROSECONDS * bit_rate)),
            at=float(syncs[worst] / MICROSECONDS),
            period=float(np.median(given) / MICROSECONDS),
        )

    def _counted(self, without: frozenset[str]) -> NDArray[np.int64]:
        """Bits of each frame, 0 for those of a service that is left out."""
        return np.where(np.isin(self._services, sorted(without)), 0, self._bits)

    def _window(self, first: int, end: int, length: float, without: frozenset[str]) -> Window:
        counted = first + np.flatnonzero(~np.isin(self._services[first:end], sorted(without)))
        names, places = np.unique(self._services[counted], return_inverse=True)
        sums = np.bincount(places, weights=self._bits[counted])
        return Window(
            start=float(self._stamps[first] / MICROSECONDS),
            length=length / MICROSECONDS,
            frames=len(counted),
            bits=int(self._bits[counted].sum()),
            by_service={str(name): int(bits) for name, bits in zip(names, sums, strict=True)},
        )


_service = cache(service)


def _sums(bits: NDArray[np.int64]) -> NDArray[np.int64]:
    """Bits before each frame and, last, of all, (n + 1,)."""
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(bits)])


def _carried(excess: NDArray[np.int64]) -> NDArray[np.int64]:
    """What is left over after each cycle, (n,): its excess and what the cycle before left, never below 0 (Lindley 1952)."""
    total = np.cumsum(excess)
    return np.asarray(total - np.minimum(np.minimum.accumulate(total), 0), dtype=np.int64)
