"""Time has one owner. `sync`: each SYNC is one communication cycle. `realtime`: the plant follows the wall clock."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.sync_period import MILLISECOND, SyncPeriod


@dataclass(frozen=True)
class Cycle:
    """What the drives run in one go, in servo periods; `interval` is what lies between two set-points, a SYNC from the next.

    `first`: it begins such an interval, so that set-points are taken; what a master writes later waits for the next.
    """

    periods: int
    interval: int
    first: bool = True


class Clock(ABC):
    """Decides which cycles the plant is to run now. `told` is 1006h in servo periods, 0 where it tells nothing.

    `runs_alone`: time goes on without a SYNC of the bus, so that a drive can produce SYNC and TIME.
    """

    runs_alone: bool

    def before_sync(self) -> Iterable[Cycle]:
        """What is still to run before the drives see a SYNC that has come: it came earlier than it was expected."""
        return ()

    @abstractmethod
    def at_sync(self, told: int) -> Iterable[Cycle]:
        """What to run because a SYNC came."""

    @abstractmethod
    def due(self, told: int) -> Iterable[Cycle]:
        """What to run although no SYNC came."""

    @abstractmethod
    def timers(self, simulated: float) -> float:
        """Time of the drives' timers (heartbeats, guarding, inhibit times, ...) [s]; `simulated` is the plant's."""

    @abstractmethod
    def wait(self) -> float | None:
        """Seconds until `due` is worth asking again; None if only a SYNC can move time."""

    @abstractmethod
    def hurry(self, hurries: bool) -> None:
        """Frames wait too long, or no longer do: a clock that may leave time out does so meanwhile."""


class SyncClock(Clock):
    """A SYNC advances the plant by one cycle and nothing else does: two runs are bit-identical."""

    runs_alone = False
    _cycle = Cycle(MILLISECOND, MILLISECOND)

    def at_sync(self, told: int) -> Iterable[Cycle]:
        periods = told or MILLISECOND
        if periods != self._cycle.periods:
            self._cycle = Cycle(periods, periods)
        return (self._cycle,)

    def due(self, told: int) -> Iterable[Cycle]:
        return ()

    def timers(self, simulated: float) -> float:
        return simulated

    def wait(self) -> float | None:
        return None

    def hurry(self, hurries: bool) -> None:
        """Each SYNC is its cycle: nothing may be left out."""


class RealtimeClock(Clock):
    """Follows the wall clock in cycles of about a millisecond, and locks them to SYNC as a drive's PLL does.

    While SYNCs come, what lies between two of them is as long as their period: a master's jitter moves the instant of a sample
    but not the set-points' spacing. SYNCs that outrun the wall clock run nothing; a SYNC that is late by `HOLD_OFF` lets the
    plant go on by itself. What was missed for longer than `MAKE_UP` is dropped: no jump after a master that was slow or a host
    that slept. The drives' timers are the wall clock's, whatever SYNC does. In a hurry the plant's time is left out, too.
    """

    runs_alone = True

    HOLD_OFF = 0.05
    """How late a SYNC may be before the drives run free [s]: a loaded host stalls a process for some 10 ms."""

    MAKE_UP = 0.06
    """How far the plant may stay behind the wall clock [s]: a hold-off, and a stall while polling."""

    AHEAD, MOST_AHEAD = 0.005, 0.025
    """How far SYNCs may outrun the wall clock [s]: half of their period, and within these."""

    POLL = 0.0005

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._began = self._reached = self._locked_until = now()
        self._sync = SyncPeriod()
        self._interval = _Interval(self._began, 0)
        self._outran = False
        self._hurries = False

    def before_sync(self) -> Iterable[Cycle]:
        now = self._look()
        interval = self._interval
        ahead = min(max(self.AHEAD, 0.5 * interval.periods * SERVO_PERIOD), self.MOST_AHEAD)
        self._outran = self._reached + interval.left * SERVO_PERIOD > now + ahead
        return () if self._outran else self._run(interval.rest())

    def at_sync(self, told: int) -> Iterable[Cycle]:
        now = self._look()
        known = self._sync.periods
        periods = self._sync.came(now, told)
        self._locked_until = now + periods * SERVO_PERIOD + self.HOLD_OFF
        if self._outran and periods == known:
            return ()
        self._interval = _Interval(now, periods)
        return self._run(self._interval.due(now))

    def due(self, told: int) -> Iterable[Cycle]:
        now = self._look()
        if now < self._locked_until:
            return self._run(self._interval.due(now))
        self._interval = _Interval(now, 0)
        free = min(told or MILLISECOND, MILLISECOND)
        return self._run([Cycle(free, free)] * max(0, int((now - self._reached) / (free * SERVO_PERIOD))))

    def timers(self, simulated: float) -> float:
        return self._now() - self._began

    def wait(self) -> float | None:
        return self.POLL

    def hurry(self, hurries: bool) -> None:
        self._hurries = hurries

    def _run(self, cycles: list[Cycle]) -> list[Cycle]:
        if self._hurries:
            self._reached = self._now()
            return []
        self._reached += sum(cycle.periods for cycle in cycles) * SERVO_PERIOD
        return cycles

    def _look(self) -> float:
        """The wall clock's time; `_reached`, the one that the plant has got to, follows it at `MAKE_UP` at the latest."""
        now = self._now()
        self._reached = max(self._reached, now - self.MAKE_UP)
        return now


class _Interval:
    """What runs from a SYNC to the next: `periods` servo periods, cut into cycles of about a millisecond."""

    def __init__(self, begin: float, periods: int) -> None:
        """`begin`: when the SYNC came [s]."""
        self.periods = periods
        self._begin = begin
        self._cycles = max(1, round(periods / MILLISECOND))
        self._next = 0
        self._run = 0

    @property
    def left(self) -> int:
        """Servo periods that have not run yet."""
        return self.periods - self._run

    def due(self, now: float) -> list[Cycle]:
        """The cycles that have begun by `now` [s]; each is given once."""
        cycles = []
        while self.left and now >= self._begin + self._run * SERVO_PERIOD:
            cycles.append(self._cycle())
        return cycles

    def rest(self) -> list[Cycle]:
        """All that are left."""
        cycles = []
        while self.left:
            cycles.append(self._cycle())
        return cycles

    def _cycle(self) -> Cycle:
        self._next += 1
        periods = self.periods * self._next // self._cycles - self._run
        self._run += periods
        return Cycle(periods, self.periods, self._next == 1)


CLOCKS: dict[str, type[Clock]] = {"realtime": RealtimeClock, "sync": SyncClock}
