"""`drivetwin panel` as a process beside a command, while that lasts."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial

from drivetwin.foundation.children import end_with_parent

PATIENCE = 10.0
"""Longest that the panel may take to end [s]."""


@contextmanager
def panel_beside(told: Sequence[str]) -> Iterator[None]:
    """A panel on a free port with these arguments while the block runs; its line goes to standard error, beside any JSON."""
    process = subprocess.Popen(
        [sys.executable, "-m", "drivetwin", "panel", "--port", "0", *told],
        stdin=subprocess.DEVNULL,
        stdout=sys.stderr,
        start_new_session=True,  # Ctrl-C is the command's, which then ends the panel
        preexec_fn=partial(end_with_parent, os.getpid(), signal.SIGTERM),  # noqa: PLW1509
    )
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
