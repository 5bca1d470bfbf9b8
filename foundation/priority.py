"""Who gets the processor first: what keeps a cycle asks for real-time priority, what only looks gives way (sched(7)).

Elsewhere than on Linux nothing is asked for.
"""

from __future__ import annotations

import ctypes
import logging
import os
import resource
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import FrameType

logger = logging.getLogger(__name__)

PRIORITY = 40
"""Of SCHED_FIFO: below 50, which the kernel's own interrupt threads have. A bus that is served late is a late cycle, too."""

LONGEST_RUN = 0.2
"""Without a pause at this priority [s]: whoever computes longer does not keep its cycle, and gets in everybody's way."""

REST = 1.0
"""As an ordinary process after that [s]."""

GIVES_WAY = 5
"""Of nice(2): with more, a panel on a computer that is busy with other work sees nothing of its bus any more."""

HOW = "docs/bus.md, Real time"

_CAP_IPC_LOCK = 14
"""Bit of the right to lock memory beyond any limit (capabilities(7))."""

_CAP_SYS_NICE = 23
"""Bit of the right to any priority."""

_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
"""mlockall(2): pages that are there, pages to come, and each of them only once it has been used."""


@contextmanager
def real_time() -> Iterator[str]:
    """The calling thread goes before all ordinary ones while the block runs, and its memory stays where it is.

    Yields what it got, in words. A priority of SCHED_FIFO or SCHED_RR that the process has already stays as it is; a process
    that was started to give way (nice) keeps that. Threads and processes that it starts are ordinary ones. Has to be called in
    the main thread, else nothing is asked for: there is where the watch over `LONGEST_RUN` works.
    """
    if (refusal := _refusal()) is not None:
        yield f"without real-time priority ({refusal})"
        return
    with ExitStack() as ends:
        try:
            priority = ends.enter_context(_first_in_line())
        except OSError as error:
            rights = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
            yield f"without real-time priority ({error.strerror}, ulimit -r is {rights}: see {HOW})"
            return
        memory = "locked" if ends.enter_context(_memory_locked()) else f"not locked, which takes a right: see {HOW}"
        yield f"at real-time priority {priority} (memory {memory})"


def give_way() -> None:
    """From now on this thread, and those that it starts, get the processor after others and never interrupt one of them.

    So does the whole session, where the kernel shares the processor among sessions (autogroup) and this process leads one.
    """
    if sys.platform != "linux":
        return
    os.nice(max(0, GIVES_WAY - os.getpriority(os.PRIO_PROCESS, 0)))
    os.sched_setscheduler(0, os.SCHED_BATCH | os.sched_getscheduler(0) & os.SCHED_RESET_ON_FORK, os.sched_param(0))
    if os.getsid(0) == os.getpid():
        with suppress(OSError):
            Path("/proc/self/autogroup").write_text(str(GIVES_WAY), encoding="ascii")


def _refusal() -> str | None:
    """Why nothing is asked for, None where it is."""
    if sys.platform != "linux":
        return "only on Linux"
    if threading.current_thread() is not threading.main_thread():
        return "only for a main thread"
    if (nice := os.getpriority(os.PRIO_PROCESS, 0)) > 0:
        return f"it was started with nice {nice}"
    return None


@contextmanager
def _first_in_line() -> Iterator[int]:
    """Yields the priority. Raises OSError where the process may have none."""
    before, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
    own = before & ~os.SCHED_RESET_ON_FORK
    if own in (os.SCHED_FIFO, os.SCHED_RR):
        policy, priority = own, parameter.sched_priority
    else:
        policy, priority = os.SCHED_FIFO, min(PRIORITY, _highest())
    _schedule(0, policy, priority)
    try:
        with _watched(policy, priority):
            yield priority
    finally:
        os.sched_setscheduler(0, before | os.SCHED_RESET_ON_FORK, parameter)  # to clear the flag would take a right


def _highest() -> int:
    """Priority that the process may ask for; where it may have none, the one that is then refused."""
    limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    return PRIORITY if limit in (0, resource.RLIM_INFINITY) or _may(_CAP_SYS_NICE) else limit


@contextmanager
def _watched(policy: int, priority: int) -> Iterator[None]:
    """Lets the thread rest as an ordinary one where it runs for `LONGEST_RUN` without a pause.

    The kernel sends SIGXCPU then, and adds a second to the limit each time (setrlimit(2), RLIMIT_RTTIME).
    """
    thread = threading.get_native_id()
    limits = resource.getrlimit(resource.RLIMIT_RTTIME)
    ended = threading.Lock()
    resting: list[threading.Timer] = []

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_RTTIME, (int(1e6 * LONGEST_RUN), limits[1]))

    def again() -> None:
        with ended:
            if resting:
                limit()
                _schedule(thread, policy, priority)

    def rest(_number: int, _frame: FrameType | None) -> None:
        os.sched_setscheduler(0, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))
        level = logging.DEBUG if resting else logging.WARNING
        logger.log(level, "%g s without a pause: it cannot keep up, and does without real-time priority meanwhile", LONGEST_RUN)
        resting[:] = [threading.Timer(REST, again)]
        resting[0].daemon = True
        resting[0].start()

    handler = signal.signal(signal.SIGXCPU, rest)
    limit()
    try:
        yield
    finally:
        with ended:
            resource.setrlimit(resource.RLIMIT_RTTIME, limits)
            for timer in resting:
                timer.cancel()
            resting.clear()
        signal.signal(signal.SIGXCPU, handler)


def _schedule(thread: int, policy: int, priority: int) -> None:
    """Children and threads of it shall be ordinary ones."""
    os.sched_setscheduler(thread, policy | os.SCHED_RESET_ON_FORK, os.sched_param(priority))


@contextmanager
def _memory_locked() -> Iterator[bool]:
    """Whether what has been used stays in memory. Nothing is asked for under a limit: what is needed later would be refused."""
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY or _may(_CAP_IPC_LOCK)
    libc = ctypes.CDLL(None)
    locked = unlimited and libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) == 0
    try:
        yield locked
    finally:
        if locked:
            libc.munlockall()


def _may(capability: int) -> bool:
    """Whether the process has this right."""
    told = dict(line.partition(":")[::2] for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines())
    return bool(int(told["CapEff"], 16) >> capability & 1)
