"""`drivetwin` as processes of its own: an emulator that says where it is, and commands that end."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import can

DRIVETWIN = [sys.executable, "-c", "from drivetwin.cli import main; main()"]

PATIENCE = 120.0
"""Longest that anything here may take [s]; no test asserts on how long it took."""


@dataclass(frozen=True)
class Ended:
    """A command that has ended."""

    status: int
    out: str
    err: str


def drivetwin(*arguments: object) -> Ended:
    """Run `drivetwin` to its end."""
    command = [*DRIVETWIN, *map(str, arguments)]
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    return Ended(done.returncode, done.stdout, done.stderr)


def wait_for(witness: can.BusABC, count: int, wanted: Callable[[can.Message], bool]) -> None:
    """Read a bus along until so many frames that are wanted have passed."""
    seen = 0
    while seen < count:
        frame = witness.recv(PATIENCE)
        assert frame is not None
        seen += wanted(frame)


def start(*arguments: object) -> subprocess.Popen[str]:
    """Start `drivetwin` and return at once."""
    command = [*DRIVETWIN, *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@contextmanager
def emulator(*arguments: object, bus: str = "ws://127.0.0.1:0") -> Iterator[str]:
    """An emulator, on a free port unless told; yields the name of its bus. It has to end well, and say nothing on stderr."""
    process = start("emulate", "--bus", bus, *arguments)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r"ws://127\.0\.0\.1:\d+|vcan\d+|unix:[^,\s]+", line)
        assert found is not None, line + (process.communicate(timeout=PATIENCE)[1] if not line else "")
        yield found.group()
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (0, "")
