"""How a controller is ended: who stops its axes is let finish, also where what was started is only a wrapper of it."""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path

from drivetwin.hil_tests.stand.controller_process import ControllerProcess

STOPS = """
import signal, sys, time
def stop(*_):
    time.sleep(0.8)
    print("every axis was stopped", flush=True)
    sys.exit(3)
signal.signal(signal.SIGTERM, stop)
print("moves", flush=True)
time.sleep(60)
"""

WRAPS = """
import subprocess, sys, time
subprocess.Popen([sys.executable, "-c", sys.argv[1]])
time.sleep(float(sys.argv[2]))
"""

IGNORES = """
import signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("moves", flush=True)
time.sleep(60)
"""


def started(folder: Path, *words: str, grace: float) -> ControllerProcess:
    """A program that has said that it moves."""
    process = ControllerProcess([sys.executable, "-c", *words], folder, folder / "controller.log", grace)
    while "moves" not in process.last_words():
        time.sleep(0.01)
    return process


def test_a_wrapper_that_goes_at_once_does_not_cost_the_controller_its_stop(tmp_path: Path) -> None:
    process = started(tmp_path, WRAPS, STOPS, "60", grace=30.0)
    assert not process.end()
    assert process.last_words().endswith("every axis was stopped")


def test_a_controller_left_by_its_wrapper_is_told_of_and_asked_to_stop(tmp_path: Path) -> None:
    process = started(tmp_path, WRAPS, STOPS, "0", grace=30.0)
    while process.status() is None:
        time.sleep(0.01)
    assert process.end()
    assert process.last_words().endswith("every axis was stopped")


def test_who_does_not_end_when_asked_is_killed(tmp_path: Path) -> None:
    process = started(tmp_path, IGNORES, grace=0.1)
    assert not process.end()
    assert process.status() == -signal.SIGKILL
