"""Time has one owner. `sync`: each SYNC is one communication cycle. `realtime`: the plant follows the wall clock."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable

DEFAULT_CYCLE = 0.001
"""Communication cycle where 1006h is 0 [s]."""


class Clock(ABC):
    """Decides how many communication cycles the plant is to run now."""

    @abstractmethod
    def cycles_at_sync(self, cycle: float) -> int:
        """Cycles of `cycle` seconds to run because a SYNC came."""

    @abstractmethod
    def cycles_due(self, cycle: float) -> int:
        """Cycles to run although no SYNC came."""

    @abstractmethod
    def wait(self) -> float | None:
        """Seconds until `cycles_due` is worth asking again; None if only a SYNC can move time."""


class SyncClock(Clock):
    """A SYNC advances the plant by one cycle and nothing else does: two runs are bit-identical."""

    def cycles_at_sync(self, cycle: float) -> int:
        return 1

    def cycles_due(self, cycle: float) -> int:
        return 0

    def wait(self) -> float | None:
        return None


class RealtimeClock(Clock):
    """Follows the wall clock, and locks its cycles to SYNC as a drive's PLL does.

    While SYNCs come, each is one cycle: a master's jitter moves the instant of a sample but not the set-points' spacing.
    SYNCs that outrun the wall clock run nothing; without a SYNC for `HOLD_OFF` the plant goes on by itself. What was missed
    for longer than `MAKE_UP` is dropped: no jump after a master that was slow or a host that slept.
    """

    HOLD_OFF = 0.05
    """How late a SYNC may be before the drives run free [s]: a loaded host stalls a process for some 10 ms."""

    MAKE_UP = 0.06
    """How far the plant may stay behind the wall clock [s]: a hold-off, and a stall while polling."""

    AHEAD = 0.005
    """How far a burst of SYNCs may outrun the wall clock [s]."""

    POLL = 0.0005

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._reached = now()
        self._locked_until = self._reached

    def cycles_at_sync(self, cycle: float) -> int:
        now = self._look()
        self._locked_until = now + self.HOLD_OFF
        if self._reached > now + self.AHEAD:
            return 0
        self._reached += cycle
        return 1

    def cycles_due(self, cycle: float) -> int:
        now = self._look()
        if now < self._locked_until:
            return 0
        due = max(0, int((now - self._reached) / cycle))
        self._reached += due * cycle
        return due

    def wait(self) -> float | None:
        return self.POLL

    def _look(self) -> float:
        """The wall clock's time; `_reached`, the one that the plant has got to, follows it at `MAKE_UP` at the latest."""
        now = self._now()
        self._reached = max(self._reached, now - self.MAKE_UP)
        return now


CLOCKS: dict[str, type[Clock]] = {"realtime": RealtimeClock, "sync": SyncClock}
