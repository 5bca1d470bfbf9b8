"""`drivetwin` as processes of its own: an emulator that says where it is, and commands that end.

They are forked from one that has imported everything (nursery.py): most of a command's time would be its imports.
"""

from __future__ import annotations

import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

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


class Command:
    """A `drivetwin` that runs, as `subprocess.Popen[str]` has it."""

    def __init__(self, words: Sequence[str]) -> None:
        ends = [os.pipe() for _ in range(3)]
        told = {"words": words, "folder": str(Path.cwd()), "environment": dict(os.environ)}
        socket.send_fds(_nursery(), [json.dumps(told).encode()], [write for _, write in ends])
        for _, write in ends:
            os.close(write)
        self.stdout, self.stderr, self._status = (open(read, encoding="utf-8") for read, _ in ends)  # noqa: SIM115
        self.pid = int(self._status.readline())
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """The exit status, negative of a signal; None while it runs."""
        return self._ended(0.0)

    def wait(self, timeout: float) -> int:
        """The exit status. Raises TimeoutExpired [s]."""
        if (status := self._ended(timeout)) is None:
            raise subprocess.TimeoutExpired("drivetwin", timeout)
        return status

    def send_signal(self, number: int) -> None:
        """Nothing happens where it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """At once, without a chance to tidy up."""
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout: float = PATIENCE) -> tuple[str, str]:
        """What is left of stdout and stderr, read to their ends. Raises TimeoutExpired [s] and ends the process."""
        with ThreadPoolExecutor(2) as readers:
            texts = [readers.submit(stream.read) for stream in (self.stdout, self.stderr)]
            try:
                out, err = (text.result(timeout) for text in texts)
                self.wait(timeout)
            except TimeoutError:
                self.kill()
                raise subprocess.TimeoutExpired("drivetwin", timeout) from None
        for stream in (self.stdout, self.stderr, self._status):
            stream.close()
        return out, err

    def _ended(self, timeout: float) -> int | None:
        if self.returncode is None and select.select([self._status], [], [], timeout)[0]:
            self.returncode = int(self._status.readline())
        return self.returncode


@cache
def _nursery() -> socket.socket:
    """Where commands are asked for; the process behind it ends with this one."""
    own, others = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with others:
        program = [sys.executable, str(Path(__file__).with_name("nursery.py")), str(others.fileno())]
        subprocess.Popen(program, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=[others.fileno()])
    return own


def drivetwin(*arguments: object, patience: float = PATIENCE) -> Ended:
    """Run `drivetwin` to its end. Raises TimeoutExpired where that takes longer than `patience` [s]."""
    command = start(*arguments)
    out, err = command.communicate(patience)
    assert command.returncode is not None
    return Ended(command.returncode, out, err)


def wait_for(witness: can.BusABC, count: int, wanted: Callable[[can.Message], bool]) -> None:
    """Read a bus along until so many frames that are wanted have passed."""
    seen = 0
    while seen < count:
        frame = witness.recv(PATIENCE)
        assert frame is not None
        seen += wanted(frame)


def start(*arguments: object) -> Command:
    """Start `drivetwin` and return at once."""
    return Command([str(argument) for argument in arguments])


@contextmanager
def emulator(*arguments: object, bus: str = "ws://127.0.0.1:0") -> Iterator[str]:
    """An emulator, on a free port unless told; yields the name of its bus. It has to end well, and say nothing on stderr."""
    process = start("emulate", "--bus", bus, *arguments)
    try:
        line = process.stdout.readline()
        found = re.search(r"ws://127\.0\.0\.1:\d+|vcan\d+|unix:[^,\s]+", line)
        assert found is not None, line + (process.communicate(timeout=PATIENCE)[1] if not line else "")
        yield found.group()
    finally:
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err) == (0, "")


def tell(control: Path, request: dict[str, object]) -> None:
    """A request to an emulator's control socket, which has to succeed; a busy computer may answer late."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(PATIENCE)
        connection.connect(str(control))
        connection.sendall(json.dumps(request).encode() + b"\n")
        answer = json.loads(connection.recv(4096))
    assert "error" not in answer, answer
