"""The same for many, on every core: threads, for what takes the time (filters, replays) is compiled and holds no lock.

As many as numba may use: every core, or what NUMBA_NUM_THREADS says; 1 where many diagnoses run at once (`drivetwin blind`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

import numba

NAME = "side by side"
"""Of its threads."""

Item = TypeVar("Item")
Made = TypeVar("Made")


def side_by_side(
    made: Callable[[Item], Made], items: Iterable[Item], takes_longer: Callable[[Item], bool] = lambda _: False
) -> list[Made]:
    """made(item) of each, in the order of the items; raises what the first that fails raises.

    What `takes_longer` is begun first: no thread then waits for it at the end. Within one of its own threads, and for a single
    item, it runs in the thread that asks.
    """
    waiting = list(items)
    pool = _pool(getattr(numba.config, "NUMBA_NUM_THREADS"))  # noqa: B009
    if pool is None or len(waiting) == 1 or threading.current_thread().name.startswith(NAME):
        return [made(item) for item in waiting]
    ordered = sorted(range(len(waiting)), key=lambda k: not takes_longer(waiting[k]))
    found = dict(zip(ordered, pool.map(lambda k: made(waiting[k]), ordered), strict=True))
    return [found[k] for k in range(len(waiting))]


@cache
def _pool(threads: int) -> ThreadPoolExecutor | None:
    return ThreadPoolExecutor(threads, NAME) if threads > 1 else None
