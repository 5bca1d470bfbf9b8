"""lely-core's AsyncMaster, configured by dcfgen as ros2_canopen's examples do it, boots drives and uses their services.

It takes its frames from `--bus unix:PATH`. lely-core is in no package registry: where pkg-config does not know it the tests are
skipped. dcfgen is PyPI's.
"""

from __future__ import annotations

import re
import shutil
import signal
import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import can
import pytest
from all_types import FIRST, INTEGERS, MINUTES, REALS, TEXT, TIMES, least_and_most, write_eds
from foreign import installed
from processes import PATIENCE, drivetwin, emulator, tell

from drivetwin.bus.channel import open_bus
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.canopen import ObjectDictionary
from drivetwin.emulator.canopen.time_stamp import TimeStamp

SOURCES = Path(__file__).parents[1] / "interoperability" / "lely"
MASTER, NODES, NODE = 10, (1, 2, 3), 2
SECONDS = 3
TIME = 0x100
TIME_PRODUCER = 0x4000_0000 | TIME
"""1012h of the master (CiA 301, 7.5.2.16): it may send TIME, and does where a program starts it."""

DRIVE = """
  dcf: "drive.eds"
  revision_number: 0
  heartbeat_producer: 100
  sdo:
    - {index: 0x60C2, sub_index: 1, value: 50}
    - {index: 0x60C2, sub_index: 2, value: -3}
    - {index: 0x6081, sub_index: 0, value: 1000}
    - {index: 0x6083, sub_index: 0, value: 2000}
  tpdo:
    1:
      enabled: true
      cob_id: "auto"
      transmission: 0x01
      mapping:
        - {index: 0x6041, sub_index: 0}
        - {index: 0x6061, sub_index: 0}
    2:
      enabled: true
      cob_id: "auto"
      transmission: 0x01
      mapping:
        - {index: 0x6064, sub_index: 0}
        - {index: 0x606C, sub_index: 0}
    3:
      enabled: false
    4:
      enabled: false
  rpdo:
    1:
      enabled: true
      cob_id: "auto"
      mapping:
        - {index: 0x6040, sub_index: 0}
        - {index: 0x6060, sub_index: 0}
    2:
      enabled: true
      cob_id: "auto"
      mapping:
        - {index: 0x607A, sub_index: 0}
        - {index: 0x60FF, sub_index: 0}
"""
"""What ros2_canopen's examples say of a drive, as its own tool hands it to dcfgen: once for each node."""

PATIENT = DRIVE.replace("heartbeat_producer: 100", "heartbeat_producer: 1000")
"""On a loaded host a master that misses heartbeats would reset a drive in the middle of a service."""

DRIVES = ("--machine", "scara", "--profile", "cia402-full")
ENABLED = ["state 40", "state 21", "state 23", "state 27"]
"""What a service tells on the way to 'operation enabled'."""


@dataclass(frozen=True)
class Outcome:
    """What the master said: how each boot ended, and what came of the drives afterwards."""

    status: int
    text: str

    def of(self, event: str) -> dict[int, list[str]]:
        """What an event said, by node."""
        told: dict[int, list[str]] = {}
        for node, rest in re.findall(rf"^{event} (\d+) (.*)$", self.text, re.MULTILINE):
            told.setdefault(int(node), []).append(rest)
        return told


@pytest.fixture(scope="module")
def eds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The EDS that `drivetwin eds` writes."""
    path = tmp_path_factory.mktemp("eds") / "drive.eds"
    assert drivetwin("eds", "--profile", "cia402-full", "--out", path).status == 0
    return path


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of our programs on it, compiled against the lely-core of this machine."""
    told = None
    if shutil.which("pkg-config") is not None:
        ask = ["pkg-config", "--cflags", "--libs", "liblely-coapp"]
        told = subprocess.run(ask, capture_output=True, text=True, check=False)
    if told is None or told.returncode:
        pytest.skip("lely-core is not here (pkg-config knows no liblely-coapp); with it, run `make interoperability`")
    flags = told.stdout.split()
    places = [f"-Wl,-rpath,{flag[2:]}" for flag in flags if flag.startswith("-L")]
    folder = tmp_path_factory.mktemp("lely")
    for name in ("async_master", "services"):
        source = SOURCES / f"{name}.cpp"
        subprocess.run(["g++", "-std=c++17", "-O1", "-o", folder / name, source, *flags, *places, "-lpthread"], check=True)
    return folder


@pytest.fixture
def program(programs: Path) -> Path:
    return programs / "async_master"


def configuration(folder: Path, eds: Path, period: int, drive: str = DRIVE, nodes: tuple[int, ...] = NODES) -> Path:
    """The master's DCF, whose SYNC has a period [us], with the slaves' configurations beside it; written by dcfgen."""
    drives = "".join(f"drive_{node}:\n  node_id: {node}{drive}" for node in nodes)
    own = f"master:\n  node_id: {MASTER}\n  sync_period: {period}\n  time_cob_id: {TIME_PRODUCER}\n"
    bus = f'options:\n  dcf_path: "{folder}"\n{own}{drives}'
    (folder / "bus.yml").write_text(bus, encoding="utf-8")
    shutil.copy(eds, folder / "drive.eds")
    dcfgen: list[str | Path] = [installed("dcf-tools/bin/dcfgen"), "-r", "bus.yml"]
    done = subprocess.run(dcfgen, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "master.dcf"


@contextmanager
def master(program: Path, dcf: Path, bus: str) -> Iterator[subprocess.Popen[str]]:
    """The master on a configuration."""
    command = [str(part) for part in (program, bus.removeprefix("unix:"), dcf, SECONDS, *NODES)]
    process = subprocess.Popen(command, cwd=dcf.parent, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            process.communicate(timeout=PATIENCE)


def outcome(process: subprocess.Popen[str], patience: float = PATIENCE) -> Outcome:
    text, _ = process.communicate(timeout=patience)
    return Outcome(process.returncode, text)


@pytest.mark.parametrize("period", [1000, 10_000, 20_000])
def test_three_of_three_nodes_boot(program: Path, eds: Path, tmp_path: Path, period: int) -> None:
    """1006h of the slaves is written by nobody, and their heartbeats are in time."""
    dcf = configuration(tmp_path, eds, period)
    with emulator(*DRIVES, bus=f"unix:{tmp_path}/bus") as bus, master(program, dcf, bus) as process:
        done = outcome(process)
    assert done.status == 0, done.text
    assert {node: set(told) for node, told in done.of("boot").items()} == {node: {"OK"} for node in NODES}
    assert {node: set(told) for node, told in done.of("cycle").items()} == {node: {"0"} for node in NODES}
    assert done.of("heartbeats") == {}
    assert done.of("emcy") == {}
    counts = {node: int(told[0]) for node, told in done.of("statuswords").items()}
    assert counts.keys() == set(NODES)
    assert min(counts.values()) > 10, counts


def test_a_master_that_boots_before_the_drives(program: Path, eds: Path, tmp_path: Path) -> None:
    """It asks and nobody answers; each drive is booted when its boot-up message comes."""
    dcf, control = configuration(tmp_path, eds, 10_000), tmp_path / "control"
    with emulator(*DRIVES, "--control", control, bus=f"unix:{tmp_path}/bus") as bus:
        for node in NODES:
            strike(control, {"fault": "node_dies", "node": node})
        witness = open_bus(bus)
        with master(program, dcf, bus) as process:
            await_frames(witness, {0x80})
            for node in NODES:
                strike(control, {"fault": "power_cycle", "node": node, "off": 0.1})
            done = outcome(process)
        witness.shutdown()
    assert done.status == 0, done.text
    assert {node: told[-1] for node, told in done.of("boot").items()} == dict.fromkeys(NODES, "OK")


def test_a_slave_that_appears_late(program: Path, eds: Path, tmp_path: Path) -> None:
    """One drive has no power while the others boot."""
    dcf, control = configuration(tmp_path, eds, 10_000), tmp_path / "control"
    with emulator(*DRIVES, "--control", control, bus=f"unix:{tmp_path}/bus") as bus:
        strike(control, {"fault": "node_dies", "node": 3})
        with master(program, dcf, bus) as process:
            assert process.stdout is not None
            seen = ""
            while seen.count("OK") < 2:
                line = process.stdout.readline()
                assert line, seen
                seen += line
            assert "boot 3" not in seen
            strike(control, {"fault": "power_cycle", "node": 3, "off": 0.1})
            done = outcome(process)
    assert done.status == 0, seen + done.text
    assert done.of("boot")[3][-1] == "OK"


def test_sto_low_at_boot(programs: Path, eds: Path, tmp_path: Path) -> None:
    """It boots; the fault where torque is wanted comes by EMCY and outlives a reset until STO is high; then it is enabled."""
    dcf, control = configuration(tmp_path, eds, 10_000, PATIENT, (NODE,)), tmp_path / "control"
    sto: dict[str, object] = {"fault": "sto", "node": NODE}
    with emulator(*DRIVES, "--control", control, bus=f"unix:{tmp_path}/bus") as bus:
        strike(control, sto)
        with service(programs, dcf, bus, "sto") as process:
            assert process.stdout is not None
            seen: list[str] = []
            while not (seen and seen[-1].startswith("fault")):
                seen.append(process.stdout.readline().strip())
                assert seen[-1], seen
            tell(control, {"end": sto})
            done = outcome(process)
    assert done.status == 0, done.text
    assert seen == ["boot OK", "emcy 5441", "fault 5441"]
    assert [line for line in done.text.splitlines() if line.startswith("state")] == [*ENABLED, "state 40"]


@pytest.fixture(scope="module")
def eds_with_types(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive with an object of every data type, for `drivetwin emulate --eds`."""
    return write_eds(tmp_path_factory.mktemp("eds") / "types.eds")


@contextmanager
def service(programs: Path, dcf: Path, bus: str, name: str) -> Iterator[subprocess.Popen[str]]:
    """A service of node 2 under way; lely-core's own diagnostics are in a file beside its configuration."""
    command = [str(part) for part in (programs / "services", bus.removeprefix("unix:"), dcf, NODE, name)]
    with (dcf.parent / "diagnostics.txt").open("w") as diagnostics:
        process = subprocess.Popen(command, cwd=dcf.parent, stdout=subprocess.PIPE, stderr=diagnostics, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGKILL)
            process.communicate(timeout=PATIENCE)


def told(programs: Path, eds: Path, folder: Path, name: str, *drives: object, patience: float = PATIENCE) -> list[str]:
    """What a service told, line by line; it has come to its end, and no emergency came."""
    dcf = configuration(folder, eds, 10_000, PATIENT, (NODE,))
    with emulator(*DRIVES, *drives, bus=f"unix:{folder}/bus") as bus, service(programs, dcf, bus, name) as process:
        done = outcome(process, patience)
    lines = done.text.splitlines()
    assert done.status == 0, done.text
    assert lines[0] == "boot OK"
    assert not any(line.startswith("emcy") for line in lines), done.text
    return lines[1:]


def counted(length: int) -> bytes:
    """The bytes that services.cpp makes."""
    return bytes((place * 31 + place // 251) & 0xFF for place in range(length))


TYPED = (0x02, 0x03, 0x04, 0x15, 0x05, 0x06, 0x07, 0x1B)
"""Codes of the integers that AsyncMaster has as types (lely/coapp/type_traits.hpp); the others are bytes to it."""


def bytes_of_each_type() -> Iterator[tuple[int, bytes]]:
    """Code and bytes on the bus of all that is written, in order."""
    for code in TYPED:
        bits, signed = INTEGERS[code]
        for value in (least_and_most(code)[0], least_and_most(code)[1]):
            yield code, value.to_bytes(bits // 8, "little", signed=signed)
    for code, layout in REALS.items():
        yield code, struct.pack(layout, -1.5)
    yield TEXT, b"a text of more than one segment, by lely's AsyncMaster"
    for code in sorted({*INTEGERS, *TIMES} - set(TYPED)):
        yield code, counted(6 if code in TIMES else INTEGERS[code][0] // 8)


def test_sdo_of_each_type_by_segments_and_by_blocks(programs: Path, eds: Path, eds_with_types: Path, tmp_path: Path) -> None:
    """What it writes as a type is in the drive as the type's bytes, and is read as that type again."""
    expected = []
    for code, data in bytes_of_each_type():
        index = f"{FIRST + code:04X}"
        expected += [f"{index} segments {data.hex()}", f"{index} blocks {data.hex()}", f"{index} read as written"]
    assert told(programs, eds, tmp_path, "types", "--eds", eds_with_types) == expected


def test_a_domain_of_more_than_a_megabyte(programs: Path, eds: Path, eds_with_types: Path, tmp_path: Path) -> None:
    lines = told(programs, eds, tmp_path, "domain", "--eds", eds_with_types, patience=MINUTES)
    assert lines == ["by blocks 1", "by segments 1"]


def test_sdo_aborts(programs: Path, eds: Path, tmp_path: Path) -> None:
    assert told(programs, eds, tmp_path, "aborts") == [
        "object 06020000",
        "sub-index 06090011",
        "read-only 06010002",
        "long 06070012",
        "short 06070013",
        "high 06090031",
        "value 06090030",
        "read by blocks 06020000",
        "written by blocks 06010002",
    ]


def test_node_guarding(programs: Path, eds: Path, tmp_path: Path) -> None:
    """The drive answers its remote frames with a bit that alternates; where it dies the master is told."""
    guarded = DRIVE.replace("heartbeat_producer: 100", "guard_time: 300\n  life_time_factor: 10")
    dcf, control = configuration(tmp_path, eds, 10_000, guarded, (NODE,)), tmp_path / "control"
    with (
        emulator(*DRIVES, "--control", control, bus=f"unix:{tmp_path}/bus") as bus,
        open_bus(bus) as witness,
        service(programs, dcf, bus, "guarding") as process,
    ):
        states = answers_to_guarding(witness, 4)
        strike(control, {"fault": "node_dies", "node": NODE})
        done = outcome(process)
    assert {state & 0x7F for state in states} <= {0x05, 0x7F}
    assert [state >> 7 for state in states] == [0, 1, 0, 1]
    assert done.status == 0, done.text
    assert done.text.splitlines() == ["boot OK", "guards", "guarding lost"]


def answers_to_guarding(witness: can.BusABC, count: int) -> list[int]:
    """The first answers of node 2 after the first remote frame."""
    asked, states = False, list[int]()
    while len(states) < count:
        frame = witness.recv(PATIENCE)
        assert frame is not None
        if frame.arbitration_id != 0x700 + NODE:
            continue
        if frame.is_remote_frame:
            asked = True
        elif asked:
            states.append(frame.data[0])
    return states


def test_its_time(programs: Path, eds: Path, tmp_path: Path) -> None:
    """The drive takes it; it is always the first moment of 1984: `co_time_of_day_set` (src/co/time.c) fills a copy of it."""
    consumer = TimeStamp(ObjectDictionary.from_profile(load_profile("cia402-full"), NODE), lambda: 0.0, lambda: None)
    dcf = configuration(tmp_path, eds, 10_000, PATIENT, (NODE,))
    frames = []
    with emulator(*DRIVES, bus=f"unix:{tmp_path}/bus") as bus, open_bus(bus) as witness:
        with service(programs, dcf, bus, "time") as process:
            done = outcome(process)
        while (frame := witness.recv(0)) is not None:
            frames += [bytes(frame.data)] if frame.arbitration_id == TIME else []
    assert done.text.splitlines() == ["boot OK", "register 0"]
    assert len(frames) > 1
    assert set(frames) == {bytes(6)}
    consumer.handlers[TIME](frames[0])
    assert consumer.time_of_day() == datetime(1984, 1, 1)


def test_lss(programs: Path, eds: Path, tmp_path: Path) -> None:
    """Selected, asked, set; without a node-ID it is found by fastscan, gets it back, and is booted again."""
    identity = f"0 402 10000 {NODE}"
    assert told(programs, eds, tmp_path, "lss") == [
        f"node {NODE}",
        f"identity {identity}",
        "bit rate refused",
        "without a node-ID 1",
        f"found {identity}",
        "boot OK",
    ]


def test_profile_position(programs: Path, eds: Path, tmp_path: Path) -> None:
    """Enabled and moved by PDO; each target is reached to the position window's 10,000 increments."""
    lines = told(programs, eds, tmp_path, "position")
    assert [lines[:4], lines[6:]] == [ENABLED, ["state 40"]]
    for line, target in zip(lines[4:6], (1 << 20, -(1 << 19)), strict=True):
        name, wanted, reached = line.split()
        assert (name, int(wanted)) == ("position", target)
        assert abs(int(reached) - target) < 10_000


def test_profile_velocity(programs: Path, eds: Path, tmp_path: Path) -> None:
    """Both directions; each velocity is reached to the 10,000 increments/s of its window, 606Dh."""
    lines = told(programs, eds, tmp_path, "velocity")
    assert [lines[:4], lines[6:]] == [ENABLED, ["state 40"]]
    for line, target in zip(lines[4:6], (1 << 18, -(1 << 18)), strict=True):
        name, wanted, reached = line.split()
        assert (name, int(wanted)) == ("velocity", target)
        assert abs(int(reached) - target) < 10_000


def await_frames(bus: can.BusABC, identifiers: set[int]) -> None:
    """Read a bus until each of some identifiers has been on it."""
    awaited = set(identifiers)
    while awaited:
        frame = bus.recv(PATIENCE)
        assert frame is not None, awaited
        awaited.discard(frame.arbitration_id)


def strike(control: Path, fault: dict[str, object]) -> None:
    """Make something go wrong in the emulator."""
    tell(control, {"strike": fault})
