"""The same for many, on every core: threads, for what takes the time (filters, replays) is compiled and holds no lock.

As many as numba may use: every core, or what NUMBA_NUM_THREADS says; 1 where many diagnoses run at once (`drivetwin blind`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

import numba

Item = TypeVar("Item")
Made = TypeVar("Made")


def side_by_side(made: Callable[[Item], Made], items: Iterable[Item]) -> list[Made]:
    """made(item) of each, in the order of the items; raises what the first that fails raises. Not to be nested."""
    pool = _pool(getattr(numba.config, "NUMBA_NUM_THREADS"))  # noqa: B009
    return [made(item) for item in items] if pool is None else list(pool.map(made, items))


@cache
def _pool(threads: int) -> ThreadPoolExecutor | None:
    return ThreadPoolExecutor(threads) if threads > 1 else None
