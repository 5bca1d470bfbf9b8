"""Child processes that end with their parent, even if it is killed: Linux signals them (prctl(2), PR_SET_PDEATHSIG)."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

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


def tied_processes() -> SpawnContext:
    """For a pool whose processes end with the one that started them, those too that still import what they are to run."""
    return _TiedContext()


class _Tie:
    """Ties the process in which it is unpickled to the one in which it was pickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return end_with_parent, (os.getpid(),)


class _TiedProcess(SpawnProcess):
    def __getstate__(self) -> dict[str, Any]:
        """The tie comes first: all that is unpickled after it may import for seconds."""
        return {"_tie": _Tie(), **self.__dict__}


class _TiedContext(SpawnContext):
    Process = _TiedProcess
