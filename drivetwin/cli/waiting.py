"""A command that waits says for what, and gives up in one line."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from drivetwin.foundation.errors import UserError

FIRST, EVERY = 3.0, 10.0
"""When it is said that something is waited for, and how often after that [s]."""

PATIENCE = 300.0
"""Longest wait [s]: a busy computer may take minutes to compile a plant."""

ITS_START = "it starts, and compiles its plant where it never ran on this computer"
"""What an emulator does until it is on its bus."""


@contextmanager
def waiting(what: str, patience: float = PATIENCE) -> Iterator[None]:
    """What the block does may wait, for `patience` [s] at most; lines on standard error say for what. In the main thread.

    Raises UserError after that, wherever the block then is (SIGALRM).
    """
    began = time.monotonic()

    def tell(_number: int, _frame: FrameType | None) -> None:
        waited = time.monotonic() - began
        if waited >= patience:
            raise UserError(f"gave up after {waited:.0f} s of waiting for {what}")
        print(f"drivetwin: waiting for {what} ({waited:.0f} s)", file=sys.stderr, flush=True)

    before = signal.signal(signal.SIGALRM, tell)
    signal.setitimer(signal.ITIMER_REAL, min(FIRST, patience), min(EVERY, patience))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
