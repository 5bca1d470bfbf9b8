"""Keeps the garbage collector from interrupting real-time code: a pass over a large heap takes tens of milliseconds."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collector() -> Iterator[None]:
    """Suspend automatic collection; reference counting still frees memory. Can be nested."""
    runs = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if runs:
            gc.enable()


def keep_for_good() -> None:
    """Exclude all present objects from later collections, so that these stay short in programs that run for days."""
    gc.collect()
    gc.freeze()
