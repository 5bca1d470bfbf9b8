"""A process that has imported all of `drivetwin` and waits; each command is a process of its own, forked from it.

Run as `python nursery.py SOCKET_FD`: a request is one message, `{"words": ..., "folder": ..., "environment": ...}` in JSON with
three descriptors: stdout, stderr, and a pipe on which the process's ID and then its exit status are told, a line each.
"""

from __future__ import annotations

import gc
import json
import os
import pkgutil
import signal
import socket
import sys
from importlib import import_module

from drivetwin import cli
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

LONGEST = 1 << 20
"""Bytes of a request."""


def next_command(requests: socket.socket) -> None:
    """Fork for each request; returns in the process of a command, ready for it. Ends when nobody asks any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # who waits for a command is waited for by nobody
    while True:
        told, given, _, _ = socket.recv_fds(requests, LONGEST, 3)
        if not told:
            os._exit(0)
        if os.fork() == 0:
            requests.close()
            _begin(told, *given)
            return
        for descriptor in given:
            os.close(descriptor)


def _begin(told: bytes, out: int, err: int, status: int) -> None:
    """Become a process of a command; the one that was forked first waits for it and tells how it ended."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    command = os.fork()
    if command:
        os.close(out)
        os.close(err)
        os.write(status, f"{command}\n".encode())
        os.write(status, f"{os.waitstatus_to_exitcode(os.waitpid(command, 0)[1])}\n".encode())
        os._exit(0)
    os.close(status)
    for descriptor, standard in ((out, 1), (err, 2)):
        os.dup2(descriptor, standard)
        os.close(descriptor)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    asked = json.loads(told)
    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    sys.argv = ["drivetwin", *asked["words"]]


def import_everything() -> None:
    """The modules of every command, and what is compiled of a drive; who is forked shares them for good."""
    for module in pkgutil.iter_modules(cli.__path__):
        import_module(f"{cli.__name__}.{module.name}")
    VirtualMachine(load_machine("stage"), load_profile("servoone"), (), SyncClock(), 0, lambda _: None)
    gc.freeze()


if __name__ == "__main__":
    import_everything()
    next_command(socket.socket(fileno=int(sys.argv[1])))
    cli.main()
