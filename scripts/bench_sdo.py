"""How fast SDO is answered under one client: by the drives, by canopen's LocalNode, by a repeater of what the drives said.

The repeater computes nothing, so that how much faster it is than LocalNode is the most that any server can reach under this
client. LocalNode has no block transfer: it sends and takes the same megabyte in segments, as it offers a client that asks.

In process by itself; on SocketCAN with a server a process, each on an interface of its own, where those are named:

    VCAN_IFACES="vcan0 vcan1 vcan2" scripts/vcan/run-in-vcan .venv/bin/python scripts/bench_sdo.py vcan0 vcan1 vcan2
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import can
import canopen
from rich.console import Console
from rich.table import Table

from drivetwin.bus.channel import InprocBus, Peer, open_bus
from drivetwin.controller.dictionary import object_dictionary
from drivetwin.controller.link import Link, PumpedNode
from drivetwin.drive_profiles import DriveProfile, load_profile
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.drive_profiles.profile import Access, DataType
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

NODE, STATUSWORD, VELOCITY, LARGE = 1, 0x6041, 0x6081, 0x2FFF
ROUND_TRIPS = 1000
DRIVES, LOCAL, REPEATER = SERVERS = ("drives", "canopen's LocalNode", "repeater")


def with_large_object() -> DriveProfile:
    """The ServoOne with a DOMAIN that a megabyte fits into."""
    profile = load_profile("servoone")
    like = next(entry for entry in profile.objects if entry.index == STATUSWORD)
    large = replace(like, index=LARGE, name="Large", data_type=DataType.DOMAIN, access=Access.RW, default=None)
    return replace(profile, objects=(*profile.objects, replace(large, rpdo=False, tpdo=False, low=None, high=None)))


class LocalNode:
    """canopen's own simulated node: `Peer`."""

    def __init__(self, transmit: Callable[[can.Message], None]) -> None:
        self._network = _Network(transmit)
        self._network.add_node(local_node())

    def receive(self, message: can.Message) -> None:
        """Take one frame; it is answered before this returns."""
        self._network.notify(message.arbitration_id, message.data, message.timestamp)

    def poll(self) -> None:
        """It does nothing by itself."""

    def wait(self) -> float | None:
        """Only a frame moves it."""
        return None


class _Network(canopen.Network):
    def __init__(self, transmit: Callable[[can.Message], None]) -> None:
        super().__init__()
        self._transmit = transmit

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        """Of the node, to the bus."""
        self._transmit(can.Message(arbitration_id=can_id, data=data, is_remote_frame=remote, is_extended_id=False))


def local_node() -> canopen.LocalNode:
    """A LocalNode that holds what is read."""
    node = canopen.LocalNode(NODE, object_dictionary(with_large_object()))
    node.sdo[STATUSWORD].raw = 0x0250
    return node


Answers = list[can.Message]
Transmit = Callable[[can.Message], None]
Connect = Callable[[Transmit], Peer]


class Recorder:
    """A peer whose answers to each frame are noted."""

    def __init__(self, connect: Connect, transmit: Transmit) -> None:
        self.noted: list[Answers] = []
        self._transmit = transmit
        self._peer = connect(self._note)
        self.noted.clear()

    def receive(self, message: can.Message) -> None:
        """Take one frame."""
        self.noted.append([])
        self._peer.receive(message)

    def poll(self) -> None:
        """As the peer."""
        self._peer.poll()

    def wait(self) -> float | None:
        """As the peer."""
        return self._peer.wait()

    def _note(self, message: can.Message) -> None:
        if self.noted:
            self.noted[-1].append(message)
        self._transmit(message)


class Repeater:
    """Answers each frame with what was recorded after its like, one list after the other, and again: `Peer`."""

    def __init__(self, told: Sequence[Answers], transmit: Transmit) -> None:
        self._told = deque(told)
        self._transmit = transmit

    def receive(self, _message: can.Message) -> None:
        """Take one frame."""
        for answer in self._told[0]:
            self._transmit(answer)
        self._told.rotate(-1)

    def poll(self) -> None:
        """It does nothing by itself."""

    def wait(self) -> float | None:
        """Only a frame moves it."""
        return None


Clock = Callable[[], float]
"""Seconds: of the processor in process, as other work may share it; of the wall where servers are processes of their own."""

# -- what the client does -------------------------------------------------------------------------------------------------


def read_status(node: PumpedNode) -> float:
    """Median of expedited uploads [s]."""
    return _median(lambda: node.sdo.upload(STATUSWORD, 0))


def write_velocity(node: PumpedNode) -> float:
    """Median of expedited downloads [s]."""
    return _median(lambda: node.sdo.download(VELOCITY, 0, b"\x10\x27\x00\x00"))


def read_large(node: PumpedNode, large: bytes, now: Clock, *, block: bool) -> float:
    """An upload of what the server holds, which is `large` [s]."""
    began = now()
    with node.sdo.open(LARGE, 0, "rb", buffering=8192, block_transfer=block) as file:
        data = file.read()
    took = now() - began
    assert data == large
    return took


def write_large(node: PumpedNode, large: bytes, now: Clock, *, block: bool) -> float:
    """A download [s]."""
    began = now()
    with node.sdo.open(LARGE, 0, "wb", buffering=8192, size=len(large), block_transfer=block) as file:
        file.write(large)
    return now() - began


def _median(asks: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUND_TRIPS):
        began = time.perf_counter()
        asks()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


@dataclass(frozen=True)
class Task:
    """What is measured; `of` a node that has block transfers or has not [s]."""

    what: str
    of: Callable[[PumpedNode, bool], float]
    once: Callable[[PumpedNode], object]
    """The frames of one repetition, which the repeater learns."""


def tasks(large: bytes, now: Clock) -> tuple[Task, ...]:
    """What is measured of a server; what is read of `large` was written before."""
    size = f"{len(large) / 1e6:g} MB in blocks"

    def write(node: PumpedNode, block: bool = True) -> float:
        return write_large(node, large, now, block=block)

    def read(node: PumpedNode, block: bool = True) -> float:
        return read_large(node, large, now, block=block)

    return (
        Task("expedited upload", lambda node, _: read_status(node), lambda node: node.sdo.upload(STATUSWORD, 0)),
        Task("expedited download", lambda node, _: write_velocity(node), lambda node: node.sdo.download(VELOCITY, 0, bytes(4))),
        Task(f"download of {size}", write, write),
        Task(f"upload of {size}", read, read),
    )


@dataclass(frozen=True)
class Row:
    """Medians of the servers' times [s], in the order of `SERVERS`, and of their ratios in each round."""

    where: str
    what: str
    times: tuple[float, ...]
    ratio: float
    bound: float


def measured(where: str, task: Task, nodes: Sequence[PumpedNode], count: int) -> Row:
    """One task at the three servers, in turn, so often."""
    rounds = [[task.of(node, server != LOCAL) for server, node in zip(SERVERS, nodes, strict=True)] for _ in range(count)]
    times = tuple(statistics.median(column) for column in zip(*rounds, strict=True))
    ratio, bound = (statistics.median(one[1] / one[at] for one in rounds) for at in (0, 2))
    return Row(where, task.what, times, ratio, bound)


# -- in process -----------------------------------------------------------------------------------------------------------


@contextmanager
def joined(connect: Connect) -> Iterator[PumpedNode]:
    """A client's node, its server in this process."""
    with Link(InprocBus(connect)) as link:
        yield _client(link)


def _client(link: Link) -> PumpedNode:
    node = PumpedNode(NODE, object_dictionary(with_large_object()))
    link.add_node(node)
    return node


def drives(transmit: Transmit) -> Peer:
    """The virtual stage, powered on."""
    machine = VirtualMachine(load_machine("stage"), with_large_object(), (), SyncClock(), 0, transmit)
    machine.power_on()
    return machine


def recorded(task: Task, large: bytes) -> list[Answers]:
    """What the drives answer to one repetition of a task."""
    made: list[Recorder] = []

    def connect(transmit: Transmit) -> Recorder:
        made.append(Recorder(drives, transmit))
        return made[0]

    with joined(connect) as node:
        write_large(node, large, time.perf_counter, block=True)
        made[0].noted.clear()
        task.once(node)
        return list(made[0].noted)


def in_process(large: bytes, rounds: int) -> Iterator[Row]:
    """Every task."""
    with joined(drives) as ours, joined(LocalNode) as theirs:
        for task in tasks(large, time.process_time):
            with joined(partial(Repeater, recorded(task, large))) as third:
                yield measured("in process", task, (ours, theirs, third), rounds)


# -- on SocketCAN ---------------------------------------------------------------------------------------------------------


@contextmanager
def server(*command: str) -> Iterator[None]:
    """A process that tells by a line when it answers."""
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert child.stdout is not None
        assert child.stdout.readline(), command
        yield
    finally:
        child.terminate()
        child.wait()


def on_socketcan(names: Sequence[str], large: bytes, rounds: int) -> Iterator[Row]:
    """Every task, the servers on an interface each, in the order of `SERVERS`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        eds = folder / "drive.eds"
        eds.write_text(eds_text(with_large_object(), eds.name), encoding="utf-8")
        emulate = (sys.executable, "-m", "drivetwin", "emulate", "--machine", "stage", "--eds", str(eds), "--clock", "sync")
        this = (sys.executable, __file__)
        with ExitStack() as open_:
            open_.enter_context(server(*emulate, "--bus", names[0]))
            open_.enter_context(server(*this, "--local", names[1]))
            nodes = [_client(open_.enter_context(Link(open_bus(name)))) for name in names]
            for number, task in enumerate(tasks(large, time.perf_counter)):
                file = folder / f"{number}.json"
                told = [[_plain(one) for one in answers] for answers in recorded(task, large)]
                file.write_text(json.dumps(told), encoding="ascii")
                with server(*this, "--repeat", str(file), names[2]):
                    yield measured("vcan", task, nodes, rounds)


def _plain(message: can.Message) -> tuple[int, str]:
    return message.arbitration_id, bytes(message.data).hex()


def _message(identifier: int, data: str) -> can.Message:
    return can.Message(arbitration_id=identifier, data=bytes.fromhex(data), is_extended_id=False)


def serve_local(name: str) -> None:
    """canopen's LocalNode as its own documentation runs it, until the process ends."""
    network = canopen.Network()
    network.connect(interface="socketcan", channel=name)
    network.add_node(local_node())
    print("ready", flush=True)
    while True:
        time.sleep(1.0)


def serve_repeater(name: str, file: Path) -> None:
    """A repeater, until the process ends."""
    told = json.loads(file.read_text(encoding="ascii"))
    with can.Bus(interface="socketcan", channel=name) as bus:
        answers = [[_message(*each) for each in one] for one in told]
        repeater = Repeater(answers, bus.send)
        print("ready", flush=True)
        while True:
            message = bus.recv()
            if message is not None:
                repeater.receive(message)


def table(rows: Sequence[Row]) -> Table:
    """Times in microseconds, ratios."""
    told = Table("where", "what", *(f"{server}, us" for server in SERVERS), "drives, times faster", "bound")
    for row in rows:
        told.add_row(row.where, row.what, *(f"{1e6 * one:.1f}" for one in row.times), f"{row.ratio:.2f}", f"{row.bound:.2f}")
    return told


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("interfaces", nargs="*", help="three of SocketCAN: for the drives, LocalNode and the repeater")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--large", type=int, default=1_000_000, metavar="BYTES", help="of the transfer in blocks (1000000)")
    parser.add_argument("--local", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--repeat", type=Path, help=argparse.SUPPRESS)
    told = parser.parse_args()
    if told.local:
        serve_local(told.interfaces[0])
    elif told.repeat is not None:
        serve_repeater(told.interfaces[0], told.repeat)
    elif len(told.interfaces) not in (0, len(SERVERS)):
        parser.error("expected three interfaces, or none")
    else:
        large = random.Random(1).randbytes(told.large)
        names = told.interfaces
        rows = list(on_socketcan(names, large, told.rounds) if names else in_process(large, told.rounds))
        Console(width=140, highlight=False).print(table(rows))


if __name__ == "__main__":
    main()
