"""When the next cycle starts: at once where SYNC drives the plant, by the wall clock in real time."""

from __future__ import annotations

import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from math import inf
from typing import TypeVar

from drivetwin.controller.bring_up import check_time_stands_still
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.link import Link
from drivetwin.foundation.priority import real_time

Found = TypeVar("Found")

SWITCH_INTERVAL = 0.0005
"""Longest that Python code of a computation keeps the cycles waiting for the interpreter's lock [s]."""


class Pacing(ABC):
    """Waits between communication cycles."""

    late_cycles = 0
    worst_lateness = 0.0
    first_answer = 3.0
    """Longest wait for the first answer to a SYNC [s]; nothing moves meanwhile where SYNC drives the plant."""
    further_answer = 0.5
    """Longest wait for the next one [s]: they come together, and only a loaded host keeps them apart."""

    @abstractmethod
    def wait(self, cycle: float) -> None:
        """Return when the next cycle of `cycle` seconds is due."""

    @abstractmethod
    def lap(self, cycle: float) -> float:
        """Seconds since it was asked before; asked as SYNC goes, once in each cycle of `cycle` seconds."""

    @abstractmethod
    def meanwhile(self, compute: Callable[[], Found], run_cycle: Callable[[], None]) -> Found:
        """The result of a computation, during which cycles go on where time does.

        Trouble in a cycle is raised at once; the process then ends when the computation has.
        """

    @abstractmethod
    def check(self, link: Link, drive: DriveNode) -> None:
        """Raise UserError where the drive's time is not what this pacing takes it for."""

    def priority(self) -> AbstractContextManager[str]:
        """The processor's, in words, while cycles are kept in this way: an ordinary one where a late cycle costs nothing."""
        return nullcontext("at ordinary priority")

    @abstractmethod
    def time(self) -> float:
        """Time for the bus log [s]: of the plant since the start where SYNC drives it, of day where time is real."""


class Lockstep(Pacing):
    """Every cycle starts when the last one has been answered; the plant's time is the number of SYNCs."""

    def __init__(self) -> None:
        self._time = 0.0

    def wait(self, cycle: float) -> None:
        self._time += cycle

    def lap(self, cycle: float) -> float:
        return cycle

    def meanwhile(self, compute: Callable[[], Found], run_cycle: Callable[[], None]) -> Found:
        return compute()

    def check(self, link: Link, drive: DriveNode) -> None:
        check_time_stands_still(link, drive)

    def time(self) -> float:
        return self._time


class Paced(Lockstep):
    """Lockstep to be looked at: no cycle starts before it is due on the wall clock, and one that is late costs nothing."""

    def __init__(self, now: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep) -> None:
        super().__init__()
        self._now = now
        self._sleep = sleep
        self._due = -inf

    def wait(self, cycle: float) -> None:
        super().wait(cycle)
        now = self._now()
        self._due = max(self._due + cycle, now)
        self._sleep(self._due - now)


class Realtime(Pacing):
    """Cycles on the wall clock. A cycle that is late by more than half of one is counted, and the grid moves by it."""

    first_answer = 0.1
    further_answer = 0.02
    """Axes move on without set-points meanwhile: as short as a loaded host's stalls allow [s]."""

    def __init__(self, now: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep) -> None:
        self._now = now
        self._sleep = sleep
        self._due: float | None = None
        self._last_lap: float | None = None

    def wait(self, cycle: float) -> None:
        now = self._now()
        due = now if self._due is None else self._due + cycle
        if due > now:
            self._sleep(due - now)
        lateness = self._now() - due
        if lateness > 0.5 * cycle:
            self.late_cycles += 1
            self.worst_lateness = max(self.worst_lateness, lateness)
            due += lateness
        self._due = due

    def lap(self, cycle: float) -> float:
        before, self._last_lap = self._last_lap, self._now()
        return cycle if before is None else self._last_lap - before

    def meanwhile(self, compute: Callable[[], Found], run_cycle: Callable[[], None]) -> Found:
        usual = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH_INTERVAL)
        pool = ThreadPoolExecutor(1)
        try:
            found = pool.submit(compute)
            found.add_done_callback(lambda _: sys.setswitchinterval(usual))  # not before: after trouble the axes are stopped
            while not found.done():
                run_cycle()
            return found.result()
        finally:
            pool.shutdown(wait=False)  # trouble on the bus must not wait for it

    def check(self, link: Link, drive: DriveNode) -> None:
        return  # a drive that SYNC moves, moves on the wall clock if SYNC does

    def priority(self) -> AbstractContextManager[str]:
        return real_time()

    def time(self) -> float:
        return time.time()


PACINGS: dict[str, type[Pacing]] = {"sync": Lockstep, "realtime": Realtime}
