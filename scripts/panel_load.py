"""What a panel costs the machine beside it: late cycles of a 1 kHz master, processor time, memory, frames beside a deaf page.

An emulator in real time and a master of its own are on one bus: set-points, SYNC and actual values of three drives each
millisecond. The drives have no voltage, so that a busy computer stops nothing. First a panel with a page that watches twelve
channels comes and goes, block by block: a computer that does other work too is not equally busy all the time. Then one panel
stays, and every other minute a page beside it asks for more and reads nothing.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, astuple, dataclass
from itertools import cycle
from math import inf, isfinite
from multiprocessing.sharedctypes import Synchronized
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection
from websockets.sync.client import connect as open_wire
from websockets.typing import Origin

from drivetwin.bus.channel import open_bus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.error_control import HEARTBEAT, HEARTBEAT_COB_ID
from drivetwin.controller.link import NMT_COB_ID, SYNC_COB_ID, Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Realtime
from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.collector import without_collector
from drivetwin.foundation.files import provenance, write_json
from drivetwin.foundation.priority import real_time
from drivetwin.foundation.scratch import scratch

MACHINE, PROFILE = "scara", "servoone"

ROLES = load_profile(PROFILE).roles
PER_CYCLE = [
    (0x6064, 0),
    (0x6040, 0),
    *((ROLES[name].index, ROLES[name].subindex) for name in ("torque_actual", "position_setpoint")),
]
CHANNELS = [f"{node}:{index:04X}:{subindex:02X}" for node in (1, 2, 3) for index, subindex in PER_CYCLE]
"""Twelve that PDOs bring in each cycle."""

SETTLING = 5.0
"""Between the page's first frame and the block that counts [s]."""

MEMORY_EVERY = 10.0
"""[s]"""

WARM = 180.0
"""The scope keeps two minutes of each channel at most: from here on memory is to be flat [s]."""

PERIOD = 0.001
"""Communication cycle [s]."""

BEAT = 100
"""Cycles between two heartbeats of the master."""

START_ALL = b"\x01\x00"
"""NMT: start every node (CiA 301, 7.2.8.3.1)."""

ANSWER = 0.02
"""Longest wait for the drives' answers to a SYNC [s]."""

PATIENCE = 900.0
"""Longest wait for a process [s]: on a busy computer a panel and its page take minutes to begin."""

RESAMPLED = 2000
"""Times that pairs are drawn anew."""


@dataclass(frozen=True)
class Block:
    """`seconds` of the master's life: cycles, those that began late, samples that did not come.

    And processor time [s] of emulator and panel, and the frames that a page got.
    """

    cycles: int
    late: int
    missed: int
    seconds: float
    emulator: float = 0.0
    panel: float = 0.0
    frames: int = 0

    def __add__(self, other: Block) -> Block:
        return Block(*(one + another for one, another in zip(astuple(self), astuple(other), strict=True)))

    def __sub__(self, other: Block) -> Block:
        return Block(*(one - another for one, another in zip(astuple(self), astuple(other), strict=True)))

    @property
    def share(self) -> float:
        """Of cycles that were late."""
        return self.late / max(1, self.cycles)


NOTHING = Block(0, 0, 0, 0.0)


class Master:
    """Set-points, SYNC and actual values at 1 kHz on the wall clock, and a count of what was late."""

    def __init__(self, link: Link, drives: Sequence[DriveNode], emulator: psutil.Process) -> None:
        self._link = link
        self._drives = drives
        self._emulator = emulator
        self._pacing = Realtime()
        self._cycles = self._missed = 0

    def block(self, seconds: float, seen: Seen | None = None) -> Block:
        """At least so many seconds of cycles, beside a panel or without."""
        before, began = self._counted(seen), time.monotonic()
        while time.monotonic() - began < seconds:
            self._cycle()
        return self._counted(seen) - before

    def meanwhile(self, what: Callable[[], Any]) -> Any:
        """Do something that takes its time, while cycles go on."""
        return self._pacing.meanwhile(what, self._cycle)

    def _counted(self, seen: Seen | None) -> Block:
        """All since the start."""
        panel, frames = (0.0, 0) if seen is None else (processor_time(seen.process), seen.counted())
        used = processor_time(self._emulator)
        return Block(self._cycles, self._pacing.late_cycles, self._missed, time.monotonic(), used, panel, frames)

    def _cycle(self) -> None:
        self._pacing.wait(PERIOD)
        self._link.drain()
        for drive in self._drives:
            drive.received = 0
            drive.setpoint = self._cycles % 2  # what does not change is not sent
            drive.send_output()
        if self._cycles % BEAT == 0:
            self._link.send(HEARTBEAT_COB_ID, HEARTBEAT)
            self._link.send(NMT_COB_ID, START_ALL)  # a master that was too late for its heartbeat goes on
        self._link.send(SYNC_COB_ID, b"")
        self._cycles += 1
        due = time.monotonic() + ANSWER
        while any(drive.received == 0 for drive in self._drives):
            if not self._link.await_frame(max(0.0, due - time.monotonic())):
                self._missed += sum(drive.received == 0 for drive in self._drives)
                return


def processor_time(process: psutil.Process) -> float:
    """Of all its threads so far [s]."""
    used = process.cpu_times()
    return float(used.user + used.system)


# -- processes ------------------------------------------------------------------------------------------------------------


@contextmanager
def command(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A `drivetwin` that runs, and the first line that it says."""
    program = [sys.executable, "-m", "drivetwin", *arguments]
    with subprocess.Popen(program, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line:
                raise SystemExit(f"drivetwin {arguments[0]} did not start")
            yield process, line
        finally:
            process.terminate()
            process.wait(PATIENCE)


def open_page(url: str) -> ClientConnection:
    """A page of the panel's own origin, by another library than the server's."""
    host = url.removeprefix("http://").rstrip("/")
    return open_wire(f"ws://{host}/live", origin=Origin(url.rstrip("/")), ping_interval=None, max_size=None)


def reading_page(url: str, frames: Synchronized[int]) -> None:
    """Watches the scope with all channels, and counts what it is told once each of them comes by PDO."""
    settings = {"window": 5.0, "pre": 0.2, "trigger": None, "xy": None}
    with open_page(url) as wire:
        wire.send(json.dumps({"id": 1, "ask": "scope set", "channels": CHANNELS, **settings}))
        wire.send(json.dumps({"id": 2, "ask": "watch", "view": "scope"}))
        while True:
            told = json.loads(wire.recv(PATIENCE))
            if "refused" in told:
                raise SystemExit(told["refused"])
            if "view" in told:
                wire.send('{"ask": "seen"}')
                frames.value += all(one["source"] == "PDO" and one["last"] is not None for one in told["channels"])


def deaf_page(url: str, leave: Event) -> None:
    """Asks for ever more frames of the scope and reads none."""
    with open_page(url) as wire:
        wire.send(json.dumps({"id": 1, "ask": "watch", "view": "scope"}))
        try:
            while not leave.wait(0.05):
                wire.send('{"ask": "seen"}')
        except ConnectionClosed:
            leave.wait(PATIENCE)


@dataclass(frozen=True)
class Seen:
    """A panel that is looked at: its process, its address, and how many frames the page has got."""

    process: psutil.Process
    url: str
    frames: Synchronized[int]

    def counted(self) -> int:
        """Frames with all channels, so far."""
        return int(self.frames.value)


@contextmanager
def panel(bus: str) -> Iterator[Seen]:
    """A panel on the bus with one page that reads, once that page sees twelve channels."""
    spawn = multiprocessing.get_context("spawn")
    frames = spawn.Value("l", 0)
    with command("panel", "--port", "0", "--bus", bus, "--machine", MACHINE, "--profile", PROFILE) as (process, line):
        found = re.search(r"http://[^/]+/", line)
        assert found is not None, line
        page = spawn.Process(target=reading_page, args=(found.group(), frames), daemon=True)
        page.start()
        try:
            until = time.monotonic() + PATIENCE
            while frames.value == 0:
                if time.monotonic() > until or not page.is_alive():
                    raise SystemExit(f"the page never saw the channels {', '.join(CHANNELS)} come by PDO")
                time.sleep(0.1)
            yield Seen(psutil.Process(process.pid), found.group(), frames)
        finally:
            page.kill()
            page.join()


# -- measurements ---------------------------------------------------------------------------------------------------------


Pair = tuple[Block, Block]
"""Without a panel, and with one after it."""


def compared(master: Master, bus: str, pairs: int, seconds: float) -> list[Pair]:
    """Without a panel, with one, and so on in turn."""
    found = []
    for number in range(pairs):
        alone = master.block(seconds)
        with entered(master, panel(bus)) as seen:
            master.block(SETTLING)
            together = master.block(seconds, seen)
        found.append((alone, together))
        shares = f"late without {100.0 * alone.share:.3f} %, with {100.0 * together.share:.3f} %"
        print(f"{number + 1}/{pairs}: {shares}", flush=True)
    return found


def summed(pairs: Sequence[Pair]) -> Pair:
    """All blocks without a panel as one, and all with one."""
    without, beside = zip(*pairs, strict=True)
    return sum(without, NOTHING), sum(beside, NOTHING)


def ratio(pairs: Sequence[Pair]) -> float:
    """Of the shares of late cycles, with a panel over without; infinite where none was late without."""
    without, beside = summed(pairs)
    return beside.share / without.share if without.late else inf


def ratio_within(pairs: Sequence[Pair]) -> tuple[float, float]:
    """Its 90 % interval, by the bootstrap over pairs: late cycles come together, and so are no independent events."""
    chosen = np.random.default_rng(0).integers(len(pairs), size=(RESAMPLED, len(pairs)))
    low, high = np.quantile([ratio([pairs[one] for one in row]) for row in chosen], (0.05, 0.95), method="nearest")
    return float(low), float(high)


@dataclass(frozen=True)
class Long:
    """One panel over minutes: what the page got without and beside a deaf page, and memory [MB] by time [s]."""

    alone: Block
    beside_deaf: Block
    memory: list[tuple[float, float]]

    @property
    def grown(self) -> float:
        """From `WARM` to the end [MB]; from the start where it ends before."""
        since = [each for each in self.memory if each[0] >= WARM] or self.memory
        return since[-1][1] - since[0][1]

    @property
    def rates(self) -> tuple[float, float]:
        """Frames a second of the page that reads: alone, beside a deaf one."""
        alone, deaf = (block.frames / max(1e-9, block.seconds) for block in (self.alone, self.beside_deaf))
        return alone, deaf


def lasting(master: Master, bus: str, minutes: float, minute: float = 60.0) -> Long:
    """One panel, every other minute with a page that reads nothing."""
    spawn = multiprocessing.get_context("spawn")
    blocks, memory = [NOTHING, NOTHING], list[tuple[float, float]]()
    with entered(master, panel(bus)) as seen:
        began = time.monotonic()
        for deaf in cycle((0, 1)):
            if time.monotonic() - began >= 60.0 * minutes:
                break
            leave = spawn.Event()
            page = spawn.Process(target=deaf_page, args=(seen.url, leave), daemon=True)
            if deaf:
                page.start()
            master.block(SETTLING)
            until = time.monotonic() + minute - SETTLING
            while time.monotonic() < until:
                blocks[deaf] += master.block(min(MEMORY_EVERY, until - time.monotonic()), seen)
                memory.append((round(time.monotonic() - began, 1), round(seen.process.memory_info().rss / 1e6, 2)))
            if deaf:
                leave.set()
                master.meanwhile(page.join)
            print(f"{time.monotonic() - began:.0f} s: panel {memory[-1][1]:.1f} MB", flush=True)
    return Long(blocks[0], blocks[1], memory)


@contextmanager
def entered(master: Master, what: Any) -> Iterator[Any]:
    """A context whose entry and exit take their time: the axes are held meanwhile."""
    inside = master.meanwhile(what.__enter__)
    try:
        yield inside
    finally:
        master.meanwhile(lambda: what.__exit__(None, None, None))


def main() -> None:
    """Measure, print, write panel_load.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=10, help="blocks without and with a panel")
    parser.add_argument("--seconds", type=float, default=30.0, help="of a block")
    parser.add_argument("--minutes", type=float, default=10.0, help="of the one panel that stays; 0: none")
    parser.add_argument("--out", type=Path, default=Path("out/panel_load"))
    told = parser.parse_args()
    with scratch() as folder:
        bus = f"unix:{folder / 'bus'}"
        emulated = ("emulate", "--machine", MACHINE, "--profile", PROFILE, "--clock", "realtime", "--bus", bus)
        with command(*emulated) as (emulator, line), Link(open_bus(bus)) as link, without_collector(), real_time() as priority:
            print(f"{line.strip()}\nmaster {priority}", flush=True)
            drives = connect(link, load_machine(MACHINE), load_profile(PROFILE))
            bring_up(link, drives, PERIOD)
            master = Master(link, drives, psutil.Process(emulator.pid))
            pairs = compared(master, bus, told.pairs, told.seconds)
            long = lasting(master, bus, told.minutes) if told.minutes else None
    without, beside = summed(pairs)
    found, (low, high) = ratio(pairs), ratio_within(pairs)
    report: dict[str, Any] = {"without": asdict(without), "with": asdict(beside)}
    report["ratio"], report["ratio_low"], report["ratio_high"] = (one if isfinite(one) else None for one in (found, low, high))
    report["pairs"] = [(alone.late, together.late) for alone, together in pairs]
    report |= {"emulator": line.strip(), "master": priority}
    print(f"late cycles: {without.late} of {without.cycles} without, {beside.late} of {beside.cycles} with")
    print(f"ratio of the shares {found:.2f}, 90 % interval {low:.2f} to {high:.2f}")
    for name, block in (("without", without), ("with", beside)):
        a_second = [value / max(1e-9, block.seconds) for value in (block.cycles, block.emulator, block.panel)]
        print("{}: {:.0f} cycles a second; processor time a second: emulator {:.3f} s, panel {:.3f} s".format(name, *a_second))
    print(f"samples that did not come: {without.missed} without, {beside.missed} with")
    if long is not None:
        report["long"] = {**asdict(long), "grown_mb": long.grown, "frames_per_second": long.rates}
        alone, deaf = long.rates
        print(f"frames a second of a page: {alone:.2f} alone, {deaf:.2f} beside a deaf page")
        print(f"memory of the panel: {long.memory[0][1]:.1f} MB first, {long.memory[-1][1]:.1f} MB last, "
              f"{long.grown:+.2f} MB from {WARM:g} s on, or in all")  # fmt: skip
    write_json(told.out / "panel_load.json", {"schema": "panel_load/1", **provenance(0, []), **report})


if __name__ == "__main__":
    main()
