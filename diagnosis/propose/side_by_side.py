"""The same for many, on every core: threads, for what takes the time (filters, replays) is compiled and holds no lock.

As many as numba may use: every core, or what NUMBA_NUM_THREADS says; 1 where many diagnoses run at once (`drivetwin blind`).
The thread that asks works as well, and while it waits for the last of its items it takes those that another has asked for: what
is asked for within an item is shared too, and the cores stay busy until the end.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, field
from functools import cache
from threading import Condition, Thread
from typing import Any, TypeVar

import numba

NAME = "side by side"
"""Of its threads."""

Item = TypeVar("Item")
Key = TypeVar("Key", bound=Hashable)
Made = TypeVar("Made")


def side_by_side(
    made: Callable[[Item], Made], items: Iterable[Item], takes_longer: Callable[[Item], bool] = lambda _: False
) -> list[Made]:
    """made(item) of each, in the order of the items; raises what the first of them that fails raises.

    Those that `takes_longer` holds for are begun first, so that fewer threads are idle at the end. A single item runs in the
    thread that asks.
    """
    waiting = list(items)
    crew = _crew(getattr(numba.config, "NUMBA_NUM_THREADS"))  # noqa: B009
    if crew is None or len(waiting) < 2:
        return [made(item) for item in waiting]
    first = sorted(range(len(waiting)), key=lambda number: not takes_longer(waiting[number]))
    asked = _Asked(lambda number: made(waiting[number]), first[::-1])
    crew.make(asked)
    return [asked.found[number] for number in range(len(waiting))]


def by_key(made: Callable[[Key], Made], keys: Iterable[Key]) -> dict[Key, Made]:
    """made(key) of each, by key."""
    asked = list(keys)
    return dict(zip(asked, side_by_side(made, asked), strict=True))


@dataclass(eq=False)
class _Asked:
    """Items of one call by number: those that have not begun, the next one last, those being made, what came of the others."""

    made: Callable[[int], Any]
    waiting: list[int]
    running: set[int] = field(default_factory=set)
    found: dict[int, Any] = field(default_factory=dict)
    failed: dict[int, BaseException] = field(default_factory=dict)

    def take(self) -> int | None:
        """The next item; after a failure only those before it, for one of them may fail first."""
        while self.waiting:
            number = self.waiting.pop()
            if number < min(self.failed, default=number + 1):
                self.running.add(number)
                return number
        return None

    @property
    def is_over(self) -> bool:
        """Whether all is made, or it is known which fails first."""
        return not self.waiting and all(number > min(self.failed, default=number) for number in self.running)


class _Crew:
    """Threads that make items for each other."""

    def __init__(self, threads: int) -> None:
        self._changed = Condition()
        self._open: list[_Asked] = []
        for _ in range(threads - 1):
            Thread(target=self._help, name=NAME, daemon=True).start()

    def make(self, asked: _Asked) -> None:
        """All items of a call; returns when they are made, and raises what the first that fails raises."""
        with self._changed:
            self._open.append(asked)
            self._changed.notify_all()
        try:
            while (taken := self._next_for(asked)) is not None:
                self._run(*taken)
        finally:  # after a failure or Ctrl-C what has not begun is not begun
            with self._changed:
                asked.waiting.clear()
                self._open.remove(asked)
        if asked.failed:
            raise asked.failed[min(asked.failed)]

    def _help(self) -> None:
        while True:
            with self._changed:
                while (taken := self._of_others()) is None:
                    self._changed.wait()
            self._run(*taken)

    def _next_for(self, asked: _Asked) -> tuple[_Asked, int] | None:
        """An item of one's own, or of others while one's own last are being made elsewhere; None when these are made."""
        with self._changed:
            while True:
                number = asked.take()
                if number is not None:
                    return asked, number
                if asked.is_over:
                    return None
                taken = self._of_others()
                if taken is not None:
                    return taken
                self._changed.wait()

    def _of_others(self) -> tuple[_Asked, int] | None:
        """The next item of the newest call: one's own last items may be waiting for it."""
        for asked in reversed(self._open):
            number = asked.take()
            if number is not None:
                return asked, number
        return None

    def _run(self, asked: _Asked, number: int) -> None:
        try:
            found = asked.made(number)
        except Exception as error:  # noqa: BLE001  # it is raised where the item was asked for
            with self._changed:
                asked.failed[number] = error
                asked.running.discard(number)
                self._changed.notify_all()
            return
        with self._changed:
            asked.found[number] = found
            asked.running.discard(number)
            self._changed.notify_all()


@cache
def _crew(threads: int) -> _Crew | None:
    return _Crew(threads) if threads > 1 else None
