"""CANopenNode's canopend as another node and master on vcan0, commanded by cocomm (CiA 309-3).

CANopenNode is in no package registry: where canopend and cocomm are not on the PATH the tests are skipped.
"""

from __future__ import annotations

import base64
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from all_types import DOMAIN, FIRST, LARGE, MINUTES, least_and_most
from processes import PATIENCE, emulator

MASTER, NODE = 4, 2
LOG = "log"
"""What canopend is told by other nodes, beside its socket."""

TYPES = {0x02: "i8", 0x03: "i16", 0x04: "i32", 0x15: "i64", 0x05: "u8", 0x06: "u16", 0x07: "u32", 0x1B: "u64"}


@pytest.fixture(scope="module")
def socket(tmp_path_factory: pytest.TempPathFactory, eds_with_types: Path) -> Iterator[Path]:
    """canopend with a command socket, beside three drives."""
    if shutil.which("canopend") is None or shutil.which("cocomm") is None:
        pytest.skip("canopend and cocomm of CANopenNode are not on the PATH; with them, run `make interoperability`")
    folder = tmp_path_factory.mktemp("canopend")
    path = folder / "socket"
    drives = ("--machine", "scara", "--profile", "cia402-full", "--eds", eds_with_types)
    with emulator(*drives, bus="vcan0"):
        command = ["canopend", "vcan0", "-i", str(MASTER), "-c", f"local-{path}"]
        with (folder / LOG).open("w") as log:
            process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=log)
        try:
            deadline = time.monotonic() + PATIENCE
            while not path.exists():
                assert time.monotonic() < deadline
                time.sleep(0.01)
            say(path, "set sdo_timeout 5000")
            yield path
        finally:
            process.terminate()
            process.wait(PATIENCE)


def say(socket: Path, command: str) -> str:
    """The answer of a command, without its number."""
    done = subprocess.run(
        ["cocomm", "-s", socket, "-o", "flat", command], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    return done.stdout.strip().partition("] ")[2]


@pytest.mark.parametrize("code", TYPES)
@pytest.mark.parametrize("block", [0, 1])
def test_sdo_of_each_integer_by_segments_and_by_blocks(socket: Path, code: int, block: int) -> None:
    assert say(socket, f"set sdo_block {block}") == "OK"
    for value in least_and_most(code):
        assert say(socket, f"{NODE} w 0x{FIRST + code:04X} 0 {TYPES[code]} {value}") == "OK"
        assert say(socket, f"{NODE} r 0x{FIRST + code:04X} 0 {TYPES[code]}") == str(value)


@pytest.mark.parametrize(("code", "name"), [(0x08, "r32"), (0x11, "r64")])
def test_sdo_of_reals(socket: Path, code: int, name: str) -> None:
    assert say(socket, f"{NODE} w 0x{FIRST + code:04X} 0 {name} -1.5") == "OK"
    assert float(say(socket, f"{NODE} r 0x{FIRST + code:04X} 0 {name}")) == -1.5


@pytest.mark.parametrize("code", [0x10, 0x12, 0x13, 0x14, 0x16, 0x18, 0x19, 0x1A, 0x0C, 0x0D])
def test_sdo_of_what_it_has_only_as_bytes(socket: Path, code: int) -> None:
    length = {0x10: 3, 0x16: 3, 0x12: 5, 0x18: 5, 0x14: 7, 0x1A: 7}.get(code, 6)
    data = " ".join(f"{byte:02X}" for byte in range(1, length + 1))
    assert say(socket, f"{NODE} w 0x{FIRST + code:04X} 0 hex {data}") == "OK"
    assert say(socket, f"{NODE} r 0x{FIRST + code:04X} 0 hex") == data


def test_a_domain_of_more_than_a_megabyte(socket: Path) -> None:
    """Both ways by blocks, as base64; what is written comes on its input."""
    assert say(socket, "set sdo_block 1") == "OK"
    place = f"0x{FIRST + DOMAIN:04X} 0 d"
    write: list[str | Path] = ["cocomm", "-s", socket, "-o", "flat", "-i", f"{NODE} w {place}"]
    text = base64.b64encode(LARGE).decode() + "\n"
    done = subprocess.run(write, input=text, capture_output=True, text=True, timeout=MINUTES, check=False)
    assert done.stdout.strip() == "[1] OK", done.stdout[-200:] + done.stderr[-200:]
    read: list[str | Path] = ["cocomm", "-s", socket, "-o", "flat", f"{NODE} r {place}"]
    done = subprocess.run(read, capture_output=True, text=True, timeout=MINUTES, check=False)
    assert base64.b64decode(done.stdout.partition("] ")[2]) == LARGE


def test_text(socket: Path) -> None:
    assert say(socket, f"{NODE} r 0x1008 0 vs") == '"drivetwin CiA 402"'


@pytest.mark.parametrize(
    ("command", "abort"),
    [
        ("r 0x7000 0 u8", "0x06020000"),
        ("r 0x1018 9 u8", "0x06090011"),
        ("w 0x1018 1 u32 0", "0x06010002"),
        ("w 0x6086 0 i16 9", "0x06090031"),
        ("w 0x6060 0 i8 5", "0x06090030"),
    ],
)
def test_sdo_aborts(socket: Path, command: str, abort: str) -> None:
    assert say(socket, f"{NODE} {command}").startswith(f"ERROR:{abort}")


def test_nmt_and_its_node_beside_the_drives(socket: Path) -> None:
    """Every command brings its state; canopend's own heartbeat is on the same bus."""
    assert say(socket, f"{NODE} w 0x1017 0 u16 20") == "OK"
    assert say(socket, f"{MASTER} w 0x1017 0 u16 100") == "OK"
    for command, state in (("start", 5), ("stop", 4), ("preop", 0x7F)):
        assert say(socket, f"{NODE} {command}") == "OK"
        with can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x700 + NODE, "can_mask": 0x7FF}]) as bus:
            frame = bus.recv(PATIENCE)
            assert frame is not None
            assert frame.data == bytes((state,)), command
    with can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x700 + MASTER, "can_mask": 0x7FF}]) as bus:
        assert bus.recv(PATIENCE) is not None


def test_emergency(socket: Path) -> None:
    """An RPDO that is too short: 8210h."""
    assert say(socket, f"{NODE} w 0x1400 1 u32 0x202") == "OK"
    assert say(socket, f"{NODE} start") == "OK"
    with can.Bus("vcan0", interface="socketcan") as bus:
        bus.send(can.Message(arbitration_id=0x202, data=b"\0", is_extended_id=False))
    deadline = time.monotonic() + PATIENCE
    while f"node 0x{NODE:02X}: errorCode=0x8210" not in (socket.parent / LOG).read_text(encoding="utf-8"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert say(socket, f"{NODE} reset node") == "OK"


def test_its_sync(socket: Path) -> None:
    """Its own 1005h and 1006h make it the producer; TPDO 1 of the drive comes at its SYNCs."""
    for command in ("w 0x1800 2 u8 1", "w 0x1800 1 u32 0x182", "start"):
        assert say(socket, f"{NODE} {command}") == "OK"
    with can.Bus("vcan0", interface="socketcan") as bus:
        for command in ("w 0x1006 0 u32 20000", "w 0x1005 0 u32 0x40000080"):
            assert say(socket, f"{MASTER} {command}") == "OK"
        seen: list[int] = []
        while seen.count(0x182) < 5:
            frame = bus.recv(PATIENCE)
            assert frame is not None
            seen.append(frame.arbitration_id)
        assert seen.count(0x182) <= seen.count(0x80)
        assert 0x82 not in seen
    assert say(socket, f"{MASTER} w 0x1005 0 u32 0x80") == "OK"
    assert say(socket, f"{NODE} reset node") == "OK"


def test_its_time(socket: Path) -> None:
    """Sent every ten seconds; the drive tells no emergency and goes on."""
    filters = [{"can_id": identifier, "can_mask": 0x7FF} for identifier in (0x82, 0x100)]
    assert say(socket, f"{MASTER} w 0x1012 0 u32 0x40000100") == "OK"
    with can.Bus("vcan0", interface="socketcan", can_filters=filters) as bus:
        frame = bus.recv(PATIENCE)
        assert frame is not None
        assert (frame.arbitration_id, frame.dlc) == (0x100, 6)
        assert say(socket, f"{NODE} r 0x1001 0 u8") == "0"
        assert bus.recv(0.1) is None
    assert say(socket, f"{MASTER} w 0x1012 0 u32 0x100") == "OK"


def test_lss(socket: Path) -> None:
    """The drive is selected by its identity and tells its node-ID."""
    identity = [say(socket, f"{NODE} r 0x1018 {subindex} u32") for subindex in range(1, 5)]
    assert say(socket, f"lss_switch_sel {' '.join(identity)}") == "OK"
    assert say(socket, "lss_get_node") == f"0x{NODE:02X}"
    assert say(socket, "lss_switch_glob 0") == "OK"
