"""What keeps a cycle goes first where it may, says what it got, and rests where it does not keep it; what looks gives way."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import threading
import time

import pytest

from drivetwin.foundation import priority
from drivetwin.foundation.priority import GIVES_WAY, PRIORITY, real_time

needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="sched(7) is Linux's")


def may() -> bool:
    """Whether this process may have the priority, and was not started to give way."""
    with real_time() as got:
        return got.startswith("at real-time priority")


needs_right = pytest.mark.skipif(not may(), reason="real-time priority takes a right, or this process was started with nice")


def said_by(program: str) -> str:
    """What a Python program prints; it has to end well, and say nothing else."""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    return ended.stdout.strip()


@needs_right
def test_what_keeps_a_cycle_goes_first_and_its_threads_do_not() -> None:
    policies = []
    with real_time() as got:
        assert got.startswith(f"at real-time priority {PRIORITY} (memory ")
        policies.append(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK)
        thread = threading.Thread(target=lambda: policies.append(os.sched_getscheduler(0)))
        thread.start()
        thread.join()
    policies.append(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK)
    assert policies == [os.SCHED_FIFO, os.SCHED_OTHER, os.SCHED_OTHER]


@needs_right
def test_a_priority_that_was_given_stays() -> None:
    os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(7))
    try:
        with real_time() as got:
            assert got.startswith("at real-time priority 7 ")
            assert os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER | os.SCHED_RESET_ON_FORK, os.sched_param(0))


@needs_right
def test_who_runs_without_a_pause_rests(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """And goes first again later."""
    monkeypatch.setattr(priority, "LONGEST_RUN", 0.02)
    monkeypatch.setattr(priority, "REST", 0.05)
    limits = resource.getrlimit(resource.RLIMIT_RTTIME)
    with real_time():
        until = time.monotonic() + 20.0
        seen = [spun_until(os.SCHED_OTHER, until)]
        while os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK != os.SCHED_FIFO and time.monotonic() < until:
            time.sleep(0.001)
        seen += [os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, spun_until(os.SCHED_OTHER, until)]
    assert seen == [os.SCHED_OTHER, os.SCHED_FIFO, os.SCHED_OTHER]
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert "it cannot keep up" in caplog.text
    assert resource.getrlimit(resource.RLIMIT_RTTIME) == limits


def spun_until(policy: int, until: float) -> int:
    """Compute without a pause until this thread has the policy; the one that it has."""
    while (has := os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK) != policy and time.monotonic() < until:
        pass
    return has


@needs_linux
def test_who_may_not_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_told: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "getpriority", lambda *_: 0)
    monkeypatch.setattr(os, "sched_setscheduler", refused)
    limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    with real_time() as got:
        pass
    assert got == f"without real-time priority (Operation not permitted, ulimit -r is {limit}: see docs/bus.md, Real time)"


@needs_linux
def test_who_was_started_to_give_way_does_so() -> None:
    program = "import os; os.nice(3)\nfrom drivetwin.foundation.priority import real_time\nwith real_time() as got: print(got)"
    nice = min(19, os.getpriority(os.PRIO_PROCESS, 0) + 3)
    assert said_by(program) == f"without real-time priority (it was started with nice {nice})"


def test_only_a_main_thread_goes_first() -> None:
    told = []

    def ask() -> None:
        with real_time() as got:
            told.append(got)

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert told[0].startswith("without real-time priority (only ")


@needs_linux
def test_who_looks_gives_way_with_all_its_threads() -> None:
    program = (
        "import os, threading\n"
        "from drivetwin.foundation.priority import give_way\n"
        "give_way()\n"
        "show = lambda: print(os.sched_getscheduler(0), os.getpriority(os.PRIO_PROCESS, 0))\n"
        "threading.Thread(target=show).start()"
    )
    nice = max(GIVES_WAY, os.getpriority(os.PRIO_PROCESS, 0))
    assert said_by(program) == f"{os.SCHED_BATCH} {nice}"
