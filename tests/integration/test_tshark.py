"""Wireshark's CANopen dissector reads our bus logs: no frame is malformed, and it sees what the drives and masters meant."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import canopen
import pytest
import tshark_logs
from processes import PATIENCE

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.bus_log import BusLog
from drivetwin.controller.dictionary import object_dictionary
from drivetwin.controller.link import Link, PumpedNode
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

pytestmark = pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed (Debian package tshark)")

NMT, EMCY, SDO_ANSWER, SDO_REQUEST, ERROR_CONTROL = 0x0, 0x1, 0xB, 0xC, 0xE
"""Function codes of the predefined connection set (CiA 301, 7.3.5)."""

UNEXPECTED_LENGTH = 0x8240
"""EMCY of a drive that gets a SYNC with a counter and 1019h says that there is none."""


@dataclass(frozen=True)
class Line:
    """A line of a candump log."""

    cob_id: int
    data: bytes
    remote: bool

    @classmethod
    def read(cls, text: str) -> Line:
        cob_id, _, content = text.split()[2].partition("#")
        remote = content.startswith("R")
        return cls(int(cob_id, 16), b"" if remote else bytes.fromhex(content), remote)


def lines(log: Path) -> list[Line]:
    return [Line.read(text) for text in log.read_text(encoding="ascii").splitlines()]


def tshark(log: Path, *arguments: str) -> list[str]:
    """Lines that tshark says of a log, each frame read as CANopen."""
    command = ["tshark", "-r", str(log), "-d", "can.subdissector,canopen", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@dataclass(frozen=True)
class Read:
    """Numeric fields of every frame of a log, each by its name; -1 where a frame has none."""

    columns: dict[str, list[int]]

    def of(self, *names: str) -> list[tuple[int, ...]]:
        """Of the frames that have the first of them."""
        return [row for row in zip(*(self.columns[name] for name in names), strict=True) if row[0] >= 0]


def read(log: Path, *names: str) -> Read:
    """By one run of tshark, which takes seconds."""
    wanted = [part for name in names for part in ("-e", name)]
    rows = [line.split("\t") for line in tshark(log, "-T", "fields", "-E", "occurrence=f", *wanted)]
    columns = zip(*rows, strict=True)
    return Read({name: [int(cell, 0) if cell else -1 for cell in column] for name, column in zip(names, columns, strict=True)})


IDENTIFIERS = ("can.id", "canopen.function_code", "canopen.node_id")
ADDRESS = ("canopen.sdo.main_idx", "canopen.sdo.sub_idx")
COMMAND = ("canopen.nmt_ctrl.cd", "canopen.nmt_ctrl.node_id")
GUARD = ("canopen.nmt_guard.state", "canopen.nmt_guard.toggle")
TIME = ("canopen.time_stamp_ms", "canopen.time_stamp_days")


def test_a_whole_identification(identified_stage: Path) -> None:
    log = identified_stage / "bus.log"
    assert tshark(log, "-Y", "_ws.malformed") == []
    frames = lines(log)
    assert len(frames) > 50_000
    found = read(log, *IDENTIFIERS, *ADDRESS, *COMMAND, "canopen.nmt_guard.state", "canopen.em.err_code")
    assert found.of(*IDENTIFIERS) == [(line.cob_id, line.cob_id >> 7, line.cob_id & 0x7F) for line in frames]
    sdo = [line for line in frames if line.cob_id >> 7 in (SDO_REQUEST, SDO_ANSWER)]
    assert found.of(*ADDRESS) == [(int.from_bytes(line.data[1:3], "little"), line.data[3]) for line in sdo]
    assert found.of(*COMMAND) == [tuple(line.data) for line in frames if line.cob_id >> 7 == NMT]
    assert found.of("canopen.nmt_guard.state")[0] == (0x00,)
    assert found.of("canopen.em.err_code") == []


@contextmanager
def session(log: Path) -> Iterator[tuple[Link, VirtualMachine]]:
    """A master with the SCARA's three drives in this process, everything logged."""
    profile, described = load_profile("cia402-full"), load_machine("scara")
    made: list[VirtualMachine] = []

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        effects = read_effects(described.effects_path)
        made.append(VirtualMachine(described, profile, effects, SyncClock(), 0, transmit))
        return made[0]

    bus = InprocBus(connect)
    with Link(bus) as link, BusLog(log, "can0", made[0].now) as bus_log:
        link.log = bus_log.frame
        made[0].power_on()
        for node_id in (1, 2, 3):
            link.add_node(PumpedNode(node_id, object_dictionary(profile)))
        yield link, made[0]
        link.drain()


def test_every_service(tmp_path: Path) -> None:
    log = tmp_path / "bus.log"
    with session(log) as (link, virtual):
        link.drain()
        refused = talk(link)
        virtual.drives[2].fault(0x7305)
    assert tshark(log, "-Y", "_ws.malformed") == []
    others = ("canopen.sdo.cmd", "canopen.sdo.abort_code", "canopen.em.err_code", "canopen.lss.cs", "canopen.sync.counter")
    found = read(log, *IDENTIFIERS, *COMMAND, *GUARD, *TIME, *others)
    assert len(found.of("can.id")) == len(lines(log))
    # the dissector knows no transfers: it takes the last segment of a block, 81h.., for an abort too
    aborted = found.of("canopen.sdo.cmd", "canopen.sdo.abort_code")
    assert [row for row in aborted if row[0] == 0x80] == [(0x80, refused)]
    assert found.of("canopen.em.err_code") == [*[(UNEXPECTED_LENGTH,)] * 3, (0x7305,)]
    assert found.of(*COMMAND) == [(0x01, 0), (0x80, 2), (0x02, 3), (0x01, 0)]
    guarded = [(node, *guard) for *guard, node in found.of(*GUARD, "canopen.node_id")]
    assert guarded[:3] == [(1, 0x00, 0), (2, 0x00, 0), (3, 0x00, 0)]
    answered = [row[1:] for row in guarded[3:] if row[0] == 1]
    assert answered == [(0x05, 0), (0x05, 1), (0x05, 0)]
    assert [row[1] for row in guarded[3:] if row[0] == 2] == [0x7F, 0x7F]
    assert found.of(*TIME) == [(3_600_000, 15_000)]
    assert found.of("canopen.lss.cs") == [(0x04,), (0x5E,), (0x5E,), (0x5E,), (0x5E,), (0x04,)]
    assert found.of("canopen.sync.counter")[:1] == [(7,)]


def talk(link: Link) -> int:
    """All services of CiA 301 and CiA 305 once; the code with which the one wrong request was aborted."""
    sdo: Any = link[1].sdo
    name = sdo.upload(0x1008, 0)
    assert sdo.open(0x1008, 0, mode="rb", block_transfer=True).read() == name
    with sdo.open(0x6085, 0, mode="wb", size=4, block_transfer=True) as written:
        written.write((4711).to_bytes(4, "little"))
    sdo.download(0x6085, 0, (4712).to_bytes(4, "little"), force_segment=True)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        sdo.download(0x1000, 0, bytes(4))
    say(link, 0x000, "01 00")
    for _ in range(3):
        link.send_message(0x701, b"", remote=True)
        link.drain()
    say(link, 0x000, "80 02")
    link[2].sdo.download(0x1017, 0, (2).to_bytes(2, "little"))
    for counter in ("", "", "", "", "07"):
        say(link, 0x080, counter)
    say(link, 0x000, "02 03")
    say(link, 0x100, "80EE3600 983A")
    for request in ("04 01 000000000000", "5E 00 000000000000", "04 00 000000000000"):
        say(link, 0x7E5, request)
    say(link, 0x000, "01 00")
    return int(refusal.value.code)


def say(link: Link, cob_id: int, data: str) -> None:
    """A frame, and what comes back, so that the log has them in their order."""
    link.send(cob_id, bytes.fromhex(data))
    link.drain()


def test_a_log_that_is_not_read_as_it_was_meant_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, last in (("sound", "081#1081010000000000"), ("cut", "081#1081")):
        (tmp_path / name).mkdir()
        frames = f"(0.0) can0 701#00\n(0.1) can0 601#4041600000000000\n(0.2) can0 {last}\n"
        (tmp_path / name / "bus.log").write_text(frames, encoding="ascii")
    monkeypatch.setattr("sys.argv", ["tshark_logs.py", str(tmp_path / "sound")])
    assert tshark_logs.main() == 0
    monkeypatch.setattr("sys.argv", ["tshark_logs.py", str(tmp_path)])
    assert tshark_logs.main() == 1
    assert capsys.readouterr().out.splitlines() == [
        "1 of 1 logs, 3 frames, read as they were meant",
        f"{tmp_path}/cut/bus.log: frame 3 (081h) is malformed",
        "1 of 2 logs, 6 frames, read as they were meant",
    ]
