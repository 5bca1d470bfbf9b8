"""Ctrl-C and SIGTERM as an event, for commands that run until they are ended and leave nothing half done."""

from __future__ import annotations

import signal
import threading


def ended_by_signals() -> threading.Event:
    """Set by either from now on, in place of what they did before."""
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    return ended
