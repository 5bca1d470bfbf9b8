"""The garbage collector, kept from stopping what runs in real time: a look through a large heap takes tens of milliseconds."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def without_collector() -> Iterator[None]:
    """No automatic collection meanwhile; memory is freed by counting references alone. May be nested."""
    runs = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if runs:
            gc.enable()


def keep_for_good() -> None:
    """What is there now is never looked through again: for programs that run for days, whose later collections are short."""
    gc.collect()
    gc.freeze()
