"""Much at once on vcan0: twelve drives, ten masters, 65,000 SDO requests, floods. No answer is lost, and memory stays flat.

The default SDO channel of a node has one client (CiA 301, 7.2.4.1), so ten masters talk to ten nodes at the same time.
"""

from __future__ import annotations

import json
import os
import select
import signal
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import pytest
from processes import PATIENCE, Command, start

MACHINES, MASTERS, REQUESTS = 4, 10, 65_000
NODES = tuple(range(1, 13))
AXES = ("lift", "rotate", "stretch")
FLAT = 4 * 1024
"""Growth of the resident memory over tens of thousands of requests [KiB], where one frame that is kept has some 100 bytes."""

READ_SERIAL_NUMBER = bytes.fromhex("40 18 10 04 00 00 00 00")
JUNK = (0x000, 0x080, 0x100, 0x180, 0x23F, 0x3FF, 0x5FF, 0x67F, 0x701, 0x7E5)
"""NMT, SYNC, TIME, PDOs, SDO answer and request of node 127, heartbeat and LSS, all of a length or content of no use."""


@pytest.fixture(scope="module")
def emulators(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[Command]]:
    """Four machines of three drives: nodes 1 to 12, as LSS has stored them."""
    folder = tmp_path_factory.mktemp("stores")
    processes = []
    for machine in range(MACHINES):
        store = folder / str(machine)
        store.mkdir()
        for place, axis in enumerate(AXES):
            lss = {"node_id": 3 * machine + place + 1, "bit_timing": 0}
            stored = {"schema": "parameters/1", "communication": {}, "application": {}, "lss": lss}
            (store / f"{axis}.json").write_text(json.dumps(stored), encoding="utf-8")
        drives = ("--machine", "scara", "--profile", "cia402-full", "--clock", "sync", "--store", store)
        process = start("emulate", "--bus", "vcan0", *drives)
        processes.append(process)
        assert process.stdout is not None
        assert "vcan0" in process.stdout.readline()
    yield processes
    for process in processes:
        process.send_signal(signal.SIGINT)
    for process in processes:
        _, err = process.communicate(timeout=PATIENCE)
        assert (process.returncode, err) == (0, "")


@dataclass
class Master:
    """A client of one node on a socket of its own, that has one request under way."""

    bus: can.BusABC
    node: int
    answers: int = 0

    def ask(self) -> None:
        self.bus.send(can.Message(arbitration_id=0x600 + self.node, data=READ_SERIAL_NUMBER, is_extended_id=False))

    def hear(self) -> None:
        """The answer to the request: the serial number is the node-ID of the machine's file."""
        frame = self.bus.recv(0)
        assert frame is not None
        assert bytes(frame.data) == bytes.fromhex("43 18 10 04") + struct.pack("<I", serial_number(self.node))
        self.answers += 1


def serial_number(node: int) -> int:
    """1018h:04 stays that of the device where LSS gives it another node-ID."""
    return (node - 1) % len(AXES) + 1


@pytest.fixture
def masters() -> Iterator[list[Master]]:
    found = []
    for node in NODES[:MASTERS]:
        answers = [{"can_id": 0x580 + node, "can_mask": 0x7FF}]
        found.append(Master(can.Bus("vcan0", interface="socketcan", can_filters=answers), node))
    yield found
    for master in found:
        master.bus.shutdown()


def resident(process: Command) -> int:
    """Memory of a process without the pages of files, that come in when they are first read [KiB] (proc_pid_statm(5))."""
    _, resident_pages, shared_pages, *_ = Path(f"/proc/{process.pid}/statm").read_text(encoding="ascii").split()
    return (int(resident_pages) - int(shared_pages)) * os.sysconf("SC_PAGE_SIZE") // 1024


def run(masters: list[Master], requests: int) -> None:
    """So many requests of each master, each as soon as the one before is answered; all masters at the same time."""
    ends = {master.bus.fileno(): master.answers + requests for master in masters}
    for master in masters:
        master.ask()
    by_socket = {master.bus.fileno(): master for master in masters}
    while by_socket:
        ready, _, _ = select.select(list(by_socket), [], [], PATIENCE)
        assert ready, {master.node: master.answers for master in masters}
        for socket in ready:
            master = by_socket[socket]
            master.hear()
            if master.answers == ends[socket]:
                del by_socket[socket]
            else:
                master.ask()


def bursts(flood: can.BusABC, frames: list[can.Message], masters: list[Master], rounds: range) -> None:
    """A hundred of the frames a round, then a request of each master."""
    for round_ in rounds:
        for number in range(100):
            flood.send(frames[(round_ + number) % len(frames)], timeout=PATIENCE)
        run(masters, 1)


@pytest.mark.usefixtures("emulators")
def test_twelve_drives_are_there() -> None:
    with can.Bus("vcan0", interface="socketcan") as bus:
        bus.send(can.Message(arbitration_id=0, data=b"\x82\x00", is_extended_id=False))
        booted: set[int] = set()
        deadline = time.monotonic() + PATIENCE
        while booted != set(NODES):
            frame = bus.recv(PATIENCE)
            assert frame is not None
            assert time.monotonic() < deadline, booted
            if frame.arbitration_id >> 7 == 0x700 >> 7 and frame.data == b"\x00":
                booted.add(frame.arbitration_id - 0x700)


def test_ten_masters_lose_no_answer_of_65000(emulators: list[Command], masters: list[Master]) -> None:
    run(masters, 500)
    before = [resident(process) for process in emulators]
    run(masters, REQUESTS // MASTERS)
    assert sum(master.answers for master in masters) == REQUESTS + 500 * MASTERS
    grown = [resident(process) - held for process, held in zip(emulators, before, strict=True)]
    assert max(grown) < FLAT, grown


def test_a_flood_takes_no_answer_away(emulators: list[Command], masters: list[Master]) -> None:
    """40,000 frames of no use, in bursts of a hundred, among the requests. The first SYNCs among them start the plants."""
    frames = [can.Message(arbitration_id=cob_id, data=b"\xff" * 7, is_extended_id=False) for cob_id in JUNK]
    frames += [can.Message(arbitration_id=cob_id, is_extended_id=True, data=b"\x01") for cob_id in JUNK]
    with can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x7FF, "can_mask": 0x7FF}]) as flood:
        bursts(flood, frames, masters, range(40))
        before = [resident(process) for process in emulators]
        bursts(flood, frames, masters, range(40, 400))
        grown = [resident(process) - held for process, held in zip(emulators, before, strict=True)]
    assert [master.answers for master in masters] == [400] * MASTERS
    assert max(grown) < FLAT, grown
