"""lely-core's AsyncMaster with a configuration by dcfgen, written as ros2_canopen's examples write it, boots three drives.

It takes its frames from `--bus unix:PATH`. lely-core is in no package registry: where pkg-config does not know it the tests are
skipped. dcfgen is PyPI's.
"""

from __future__ import annotations

import json
import re
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can
import pytest
from foreign import installed
from processes import PATIENCE, drivetwin, emulator

from drivetwin.bus.channel import open_bus

SOURCE = Path(__file__).parents[1] / "interoperability" / "lely" / "async_master.cpp"
MASTER, NODES = 10, (1, 2, 3)
SECONDS = 3

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

DRIVES = ("--machine", "scara", "--profile", "cia402-full")


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
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The master, compiled against the lely-core of this machine."""
    told = None
    if shutil.which("pkg-config") is not None:
        ask = ["pkg-config", "--cflags", "--libs", "liblely-coapp"]
        told = subprocess.run(ask, capture_output=True, text=True, check=False)
    if told is None or told.returncode:
        pytest.skip("lely-core is not here (pkg-config knows no liblely-coapp); with it, run `make interoperability`")
    flags = told.stdout.split()
    places = [f"-Wl,-rpath,{flag[2:]}" for flag in flags if flag.startswith("-L")]
    path = tmp_path_factory.mktemp("lely") / "async_master"
    subprocess.run(["g++", "-std=c++17", "-O1", "-o", path, SOURCE, *flags, *places, "-lpthread"], check=True)
    return path


def configuration(folder: Path, eds: Path, period: int) -> Path:
    """The master's DCF, whose SYNC has a period [us], with the slaves' configurations beside it; written by dcfgen."""
    drives = "".join(f"drive_{node}:\n  node_id: {node}{DRIVE}" for node in NODES)
    bus = f'options:\n  dcf_path: "{folder}"\nmaster:\n  node_id: {MASTER}\n  sync_period: {period}\n{drives}'
    (folder / "bus.yml").write_text(bus, encoding="utf-8")
    shutil.copy(eds, folder / "drive.eds")
    dcfgen = [installed("dcf-tools/bin/dcfgen"), "-r", "bus.yml"]
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


def outcome(process: subprocess.Popen[str]) -> Outcome:
    text, _ = process.communicate(timeout=PATIENCE)
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


def await_frames(bus: can.BusABC, identifiers: set[int]) -> None:
    """Read a bus until each of some identifiers has been on it."""
    awaited = set(identifiers)
    while awaited:
        frame = bus.recv(PATIENCE)
        assert frame is not None, awaited
        awaited.discard(frame.arbitration_id)


def strike(control: Path, fault: dict[str, object]) -> None:
    """Make something go wrong in the emulator."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(PATIENCE)
        connection.connect(str(control))
        connection.sendall(json.dumps({"strike": fault}).encode() + b"\n")
        answer = json.loads(connection.recv(4096))
    assert "error" not in answer, answer
