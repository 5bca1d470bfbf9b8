"""lely-core's coctl, a gateway of CiA 309-3, as the master of three drives on vcan0.

lely-core is in no package registry: where coctl is not on the PATH, with its coctl.dcf beside it, the tests are skipped.
"""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import pytest
from all_types import DOMAIN, FIRST, INTEGERS, LARGE, MINUTES, REALS, TIMES, least_and_most
from processes import PATIENCE, emulator

MASTER, NODE = 10, 2
BEGIN = ("set network 1", f"set id {MASTER}", "init 0", "set sdo_timeout 10000")
"""What each session begins with; `init 0` boots its own node, which resets the others."""

IDENTITY = ("0x0", "0x402", "0x10000", str(NODE))
TYPES = {code: f"{'i' if signed else 'u'}{bits}" for code, (bits, signed) in INTEGERS.items()}


@dataclass(frozen=True)
class Said:
    """What coctl printed: an answer a command, and what it was told of the nodes in between."""

    answers: list[str]
    events: list[str]


@pytest.fixture(scope="module", autouse=True)
def dcf(eds_with_types: Path) -> Iterator[Path]:
    """Three drives, and the configuration of coctl's own node."""
    program = shutil.which("coctl")
    if program is None:
        pytest.skip("lely-core's coctl is not on the PATH; with it, run `make interoperability`")
    prefix = Path(program).resolve().parents[1]
    found = [path for path in (prefix / "etc" / "coctl.dcf", Path("/etc/coctl.dcf")) if path.exists()]
    if not found:
        pytest.skip(f"coctl is here, but its coctl.dcf is not in {prefix}/etc or /etc, where lely-core installs it")
    with emulator("--machine", "scara", "--profile", "cia402-full", "--eds", eds_with_types, bus="vcan0"):
        yield found[0]


def session(dcf: Path, *commands: str, patience: float = PATIENCE) -> str:
    """What it prints; each command waits for the answer of the one before."""
    lines = "".join(f"{command}\n" for command in (*BEGIN, *commands))
    told = ["coctl", "vcan0", str(dcf)]
    return subprocess.run(told, input=lines, capture_output=True, text=True, timeout=patience, check=True).stdout


def coctl(dcf: Path, *commands: str) -> Said:
    """A session of its own."""
    text = session(dcf, *commands)
    answers = re.findall(r"^\[\d+\] (.*)$", text, re.MULTILINE)
    events = [line for line in text.splitlines() if not line.startswith("[")]
    assert len(answers) == len(BEGIN) + len(commands), text
    assert answers[: len(BEGIN)] == ["OK"] * len(BEGIN)
    return Said(answers[len(BEGIN) :], events)


def test_its_boot_is_heard_and_answered(dcf: Path) -> None:
    """It resets the nodes when it boots, and is told of each boot-up."""
    said = coctl(dcf, *[f"{node} r 0x1000 0 u32" for node in (1, 2, 3)])
    assert said.answers == ["0x00020192"] * 3
    assert {f"1 {node} BOOT_UP" for node in (1, 2, 3)} <= set(said.events)


@pytest.mark.parametrize("code", TYPES)
def test_sdo_of_each_integer(dcf: Path, code: int) -> None:
    """Expedited up to 32 bits, in segments beyond; to the ends of the type."""
    ends = least_and_most(code)
    place = f"0x{FIRST + code:04X} 0 {TYPES[code]}"
    commands = [command for value in ends for command in (f"{NODE} w {place} {value}", f"{NODE} r {place}")]
    first, least, second, most = coctl(dcf, *commands).answers
    assert (first, second) == ("OK", "OK")
    assert (int(least, 0), int(most, 0)) == ends


@pytest.mark.parametrize(("code", "name"), [*zip(REALS, ("r32", "r64"), strict=True)])
def test_sdo_of_reals(dcf: Path, code: int, name: str) -> None:
    place = f"0x{FIRST + code:04X} 0 {name}"
    written, value = coctl(dcf, f"{NODE} w {place} -1.5", f"{NODE} r {place}").answers
    assert written == "OK"
    assert float(value) == -1.5


@pytest.mark.parametrize(("code", "name"), [*zip(TIMES, ("t", "td"), strict=True)])
def test_sdo_of_times(dcf: Path, code: int, name: str) -> None:
    """Days and milliseconds."""
    place = f"0x{FIRST + code:04X} 0 {name}"
    assert coctl(dcf, f"{NODE} w {place} 14905 25200448", f"{NODE} r {place}").answers == ["OK", "14905 25200448"]


def test_a_domain_of_more_than_a_megabyte(dcf: Path) -> None:
    """Both ways in segments; as text it is base64 (CiA 309-3), read in many lines."""
    place = f"0x{FIRST + DOMAIN:04X} 0 d"
    write = f"{NODE} w {place} {base64.b64encode(LARGE).decode()}"
    text = session(dcf, write, f"{NODE} r {place}", patience=MINUTES)
    written, read = len(BEGIN) + 1, len(BEGIN) + 2
    assert re.search(rf"^\[{written}\] OK$", text, re.MULTILINE)
    found = re.search(rf"^\[{read}\] ((?:[\w+/=]+\s+)+)", text, re.MULTILINE)
    assert found is not None
    assert base64.b64decode(found[1]) == LARGE


def test_text(dcf: Path) -> None:
    assert coctl(dcf, f"{NODE} r 0x1008 0 vs").answers == ['"drivetwin CiA 402"']


@pytest.mark.parametrize(
    ("command", "abort"),
    [
        ("r 0x7000 0 u8", "06020000"),
        ("r 0x1018 9 u8", "06090011"),
        ("w 0x1018 1 u32 0", "06010002"),
        ("w 0x6098 0 u32 0", "06070012"),
        ("w 0x6081 0 u8 0", "06070013"),
        ("w 0x6086 0 i16 9", "06090031"),
        ("w 0x6060 0 i8 5", "06090030"),
    ],
)
def test_sdo_aborts(dcf: Path, command: str, abort: str) -> None:
    (answer,) = coctl(dcf, f"{NODE} {command}").answers
    assert answer.startswith(f"ERROR: {abort} ")


@pytest.mark.parametrize(
    ("command", "state"), [("start", 5), ("stop", 4), ("preop", 0x7F), ("reset node", 0), ("reset comm", 0)]
)
def test_nmt_commands_are_obeyed(dcf: Path, command: str, state: int) -> None:
    """The state is told by the node's heartbeats or its boot-up message."""
    with can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x700 + NODE, "can_mask": 0x7FF}]) as bus:
        answers = coctl(dcf, f"{NODE} w 0x1017 0 u16 20", f"{NODE} {command}", f"{NODE} r 0x1000 0 u32").answers
        assert answers[:2] == ["OK", "OK"]
        told = []
        while (frame := bus.recv(0)) is not None:
            told.append(frame.data[0])
    after = told[told.index(0) + 1 :]  # its own boot resets the nodes
    assert state in after


def test_heartbeats_are_consumed(dcf: Path) -> None:
    """It tells each change of state, and a heartbeat that stays away."""
    said = coctl(
        dcf,
        f"{NODE} w 0x1017 0 u16 50",
        f"{NODE} enable heartbeat 5000",
        f"{NODE} start",
        *[f"{NODE} r 0x1000 0 u32"] * 3,
        f"{NODE} enable heartbeat 400",
        f"{NODE} w 0x1017 0 u16 0",
        *[f"{NODE} r 0x1000 0 u32"] * 8,
    )
    assert said.answers[:3] == ["OK"] * 3
    assert f"1 {NODE} ERRORx OPER" in said.events
    assert any(re.match(rf"1 {NODE} ERROR.* 20\d ", event) for event in said.events), said.events


def test_node_guarding(dcf: Path) -> None:
    """Its remote frames are answered; the bit that alternates is right, since it says nothing of an error."""
    with can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x700 + NODE, "can_mask": 0x7FF}]) as bus:
        said = coctl(dcf, f"{NODE} enable guarding 300 10", *[f"{NODE} r 0x1000 0 u32"] * 12, f"{NODE} disable guarding")
        frames = []
        while (frame := bus.recv(0)) is not None:
            frames.append(frame)
    assert said.answers[0] == said.answers[-1] == "OK"
    assert not any("guarding" in event for event in said.events), said.events
    states = [frame.data[0] for frame in frames if not frame.is_remote_frame and frame.data[0] & 0x7F == 0x7F]
    assert states[:2] == [0x7F, 0xFF]
    assert any(frame.is_remote_frame for frame in frames)


def test_emergency(dcf: Path) -> None:
    """An RPDO that is too short: 8210h."""
    said = coctl(
        dcf,
        f"{MASTER} w 0x1028 {NODE} u32 0x{0x80 + NODE:x}",
        f"{NODE} w 0x1400 1 u32 0x80000202",
        f"{NODE} w 0x1400 1 u32 0x202",
        f"{NODE} start",
        "set tpdo 1 0x202 event 1 0x2005 0 u8",
        "start",
        "write pdo 1 1 0",
        *[f"{NODE} r 0x1001 0 u8"] * 2,
    )
    assert any(event.startswith(f"1 {NODE} EMCY 8210 11 ") for event in said.events), said


def test_pdo_both_ways_at_its_sync(dcf: Path) -> None:
    """The target position comes by RPDO 2, and the drive's own value of it back by TPDO 2."""
    said = coctl(
        dcf,
        f"{MASTER} w 0x1006 0 u32 20000",
        f"{NODE} w 0x1A01 0 u8 0",
        f"{NODE} w 0x1A01 1 u32 0x607A0020",
        f"{NODE} w 0x1A01 0 u8 1",
        f"{NODE} w 0x1801 2 u8 1",
        f"{NODE} w 0x1801 1 u32 0x282",
        f"{NODE} w 0x1601 0 u8 0",
        f"{NODE} w 0x1601 1 u32 0x607A0020",
        f"{NODE} w 0x1601 0 u8 1",
        f"{NODE} w 0x1401 2 u8 1",
        f"{NODE} w 0x1401 1 u32 0x302",
        "set rpdo 1 0x282 sync1 1 0x2004 0 i32",
        "set tpdo 1 0x302 sync1 1 0x2007 0 u32",
        "start",
        "write pdo 1 1 123456",
        *[f"{NODE} r 0x607A 0 i32"] * 4,
        f"{MASTER} r 0x2004 0 i32",
    )
    assert said.answers[:15] == ["OK"] * 15
    assert said.answers[-2:] == ["123456", "123456"]
    assert "1 pdo 1 1 0x1e240" in said.events


def test_lss(dcf: Path) -> None:
    """Select by identity, inquire, bit timing."""
    identity = " ".join(IDENTITY)
    answers = coctl(
        dcf,
        f"lss_switch_sel {identity}",
        "lss_get_node",
        *[f"lss_inquire_addr 0x{command:x}" for command in range(0x5A, 0x5E)],
        "lss_conf_bitrate 0 2",
        "lss_switch_glob 0",
    ).answers
    assert answers[:2] == ["OK", str(NODE)]
    assert [int(answer, 0) for answer in answers[2:6]] == [int(part, 0) for part in IDENTITY]
    assert answers[6:] == ["OK", "OK"]


def test_lss_fastscan_finds_the_node_without_an_id(dcf: Path) -> None:
    """It loses its node-ID, is found by its identity, and gets it back."""
    taken = coctl(dcf, f"lss_switch_sel {' '.join(IDENTITY)}", "lss_set_node 255", "lss_switch_glob 0", f"{NODE} reset comm")
    assert taken.answers == ["OK"] * 4
    scan = "_lss_fastscan 0 0 0x402 0xffffffff 0x10000 0xffffffff 0 0"
    found = coctl(dcf, "lss_ident_nonconf", scan, f"lss_set_node {NODE}", "lss_switch_glob 0", f"{NODE} r 0x1000 0 u32").answers
    assert found[0] == "OK"
    assert [int(part, 0) for part in found[1].split()] == [int(part, 0) for part in IDENTITY]
    assert found[2:] == ["OK", "OK", "0x00020192"]
