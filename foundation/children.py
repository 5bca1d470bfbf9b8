"""Child processes that end with their parent, even if it is killed: Linux signals them (prctl(2), PR_SET_PDEATHSIG)."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1
_C = ctypes.CDLL(None)


def end_with_parent(parent: int, by: int = signal.SIGKILL) -> None:
    """Called in a child of process `parent`: from now on it gets the signal `by` once the thread that started it has gone.

    The request outlives exec. Elsewhere than on Linux nothing is asked for.
    """
    if sys.platform == "linux":
        _C.prctl(_PR_SET_PDEATHSIG, int(by), 0, 0, 0)
        if os.getppid() != parent:  # it went before the request
            os.kill(os.getpid(), by)
