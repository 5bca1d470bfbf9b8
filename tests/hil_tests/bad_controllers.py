"""Controllers that are none, with nothing but the standard library: python bad_controllers.py WHAT TASK_FILE BUS."""

from __future__ import annotations

import signal
import socket
import struct
import subprocess
import sys
import time
from typing import NoReturn

FRAME = struct.Struct("=IB3x8s")

SYNC = FRAME.pack(0x80, 0, b"")

FOREVER = 3600.0


def joined(bus: str) -> socket.socket:
    """The embedded bus, as a program in any language joins it."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.connect(bus.removeprefix("unix:"))
    return connection


def cycles(bus: socket.socket, count: int) -> None:
    """That many SYNCs, without looking at what comes."""
    for _ in range(count):
        bus.send(SYNC)


def never_joins(_task: str, _name: str) -> None:
    time.sleep(FOREVER)


def hangs(_task: str, name: str) -> None:
    joined(name).send(SYNC)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(FOREVER)


def crashes(_task: str, name: str) -> None:
    cycles(joined(name), 100)
    raise ZeroDivisionError("the controller's own mistake")


def floods(_task: str, name: str) -> NoReturn:
    bus = joined(name)
    while True:
        bus.send(FRAME.pack(0x7FF, 0, b""))


def never_ends(_task: str, name: str) -> NoReturn:
    bus = joined(name)
    while True:
        bus.send(SYNC)


def leaves_a_process(task: str, name: str) -> None:
    cycles(joined(name), 10)
    subprocess.Popen([sys.executable, "-c", f"import time; time.sleep({FOREVER})", task], stdin=subprocess.DEVNULL)


def refuses(_task: str, _name: str) -> NoReturn:
    print("this machine is none of mine", file=sys.stderr)
    sys.exit(2)


def stops(_task: str, _name: str) -> NoReturn:
    sys.exit(3)


def stops_with_brackets(_task: str, _name: str) -> NoReturn:
    print("[error] :warning: [/home/u/axes.cpp:88] bus off", file=sys.stderr)
    sys.exit(3)


def does_nothing(_task: str, name: str) -> None:
    cycles(joined(name), 50)


def enables_in_one_step(_task: str, name: str) -> None:
    """By the default RPDO 1, the controlword: from ready to switch on at once to operation enabled, and left there."""
    bus = joined(name)
    bus.send(FRAME.pack(0x000, 2, bytes((1, 0))))
    for word in (0x06, 0x0F):
        bus.send(FRAME.pack(0x201, 2, word.to_bytes(2, "little")))
        cycles(bus, 5)


START = FRAME.pack(0x000, 2, bytes((1, 0)))


def heartbeat(milliseconds: int) -> bytes:
    """A write of 1017h of node 1."""
    return FRAME.pack(0x601, 8, bytes((0x2B, 0x17, 0x10, 0)) + milliseconds.to_bytes(4, "little"))


def starts_a_node_again(_task: str, name: str) -> None:
    """With a heartbeat the first time; the second time as it has booted."""
    bus = joined(name)
    bus.send(heartbeat(100))
    bus.send(START)
    cycles(bus, 40)
    bus.send(START)
    cycles(bus, 5)


def changes_a_node_that_it_has_started(_task: str, name: str) -> None:
    """At once, on the wall clock: it has a heartbeat when it is started, and another one later."""
    bus = joined(name)
    for frame in (heartbeat(100), START, heartbeat(0)):
        bus.send(frame)
    time.sleep(0.3)


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:4])
