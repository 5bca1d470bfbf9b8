"""An emulator that is stopped for seconds (SIGSTOP) and goes on: what it was sent meanwhile is answered, in order."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import can
import psutil
import pytest
from processes import PATIENCE, start

from drivetwin.bus.channel import open_bus

STOPPED = 5.0
"""How long it is stopped [s]."""

REQUESTS = 40
OBJECTS = (0x1000, 0x1001, 0x6041, 0x6061)


def upload(index: int) -> can.Message:
    return can.Message(arbitration_id=0x601, data=b"\x40" + index.to_bytes(2, "little") + bytes(5), is_extended_id=False)


@pytest.mark.parametrize(("kind", "clock"), [("unix", "sync"), ("ws", "realtime")])
def test_what_was_asked_while_it_was_stopped_is_answered(kind: str, clock: str, tmp_path: Path) -> None:
    name = f"unix:{tmp_path}/bus" if kind == "unix" else "ws://127.0.0.1:0"
    process = start("emulate", "--machine", "stage", "--bus", name, "--clock", clock)
    try:
        joined = process.stdout.readline()
        bus = open_bus(joined.partition(" on ")[2].partition(",")[0])
        bus.send(upload(0x1000))
        assert answered(bus) == 0x1000
        os.kill(process.pid, signal.SIGSTOP)
        asked = [OBJECTS[number % len(OBJECTS)] for number in range(REQUESTS)]
        for index in asked:
            bus.send(upload(index))
        time.sleep(STOPPED)
        assert psutil.Process(process.pid).status() == psutil.STATUS_STOPPED
        os.kill(process.pid, signal.SIGCONT)
        assert [answered(bus) for _ in asked] == asked
        bus.shutdown()
    finally:
        process.send_signal(signal.SIGCONT)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(PATIENCE)
    assert (process.returncode, err) == (0, "")


def answered(bus: can.BusABC) -> int:
    """The object of the next SDO answer."""
    while (message := bus.recv(PATIENCE)) is not None:
        if message.arbitration_id == 0x581:
            assert message.data[0] != 0x80
            return int.from_bytes(message.data[1:3], "little")
    pytest.fail("no answer came")
