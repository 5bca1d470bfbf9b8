"""The same for many, on every core: threads, for what takes the time (filters, replays) is compiled and holds no lock.

As many as numba may use: every core, or what NUMBA_NUM_THREADS says; 1 where many diagnoses run at once (`drivetwin blind`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

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

    Those that `takes_longer` holds for are begun first, so that fewer threads are idle at the end. Within one of its own
    threads, and for a single item, it runs in the thread that asks.
    """
    waiting = list(items)
    pool = _pool(getattr(numba.config, "NUMBA_NUM_THREADS"))  # noqa: B009
    if pool is None or len(waiting) == 1 or threading.current_thread().name.startswith(NAME):
        return [made(item) for item in waiting]
    first = sorted(range(len(waiting)), key=lambda number: not takes_longer(waiting[number]))
    begun = {number: pool.submit(made, waiting[number]) for number in first}
    try:
        return [begun[number].result() for number in range(len(waiting))]
    finally:  # after a failure or Ctrl-C what has not begun is not begun
        for each in begun.values():
            each.cancel()


def by_key(made: Callable[[Key], Made], keys: Iterable[Key]) -> dict[Key, Made]:
    """made(key) of each, by key."""
    asked = list(keys)
    return dict(zip(asked, side_by_side(made, asked), strict=True))


@cache
def _pool(threads: int) -> ThreadPoolExecutor | None:
    return ThreadPoolExecutor(threads, NAME) if threads > 1 else None
