"""gocanopen, a CANopen stack in Go, as the master of node 2 and as another node on vcan0.

It is in no package registry: where GOCANOPEN names a folder with its sources `install-foreign` builds the client; elsewhere
the tests are skipped.
"""

from __future__ import annotations

import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import large_domain
import pytest
from all_types import DOMAIN, FIRST, INTEGERS, LARGE, MINUTES, REALS, SEVEN_O_CLOCK, TIMES, least_and_most
from foreign import FOREIGN
from processes import PATIENCE, emulator

PROGRAM = FOREIGN / "bin" / "gocanopen"
NODE, MASTER = 2, 10


@pytest.fixture(scope="module", autouse=True)
def _scara(eds_with_types: Path) -> Iterator[None]:
    if not PROGRAM.exists():
        pytest.skip("gocanopen is not here; with its sources, run `make interoperability GOCANOPEN=FOLDER`")
    with emulator("--machine", "scara", "--profile", "cia402-full", "--eds", eds_with_types, bus="vcan0"):
        yield


def command(*words: object) -> list[str]:
    return [str(word) for word in (PROGRAM, "vcan0", f"{NODE:x}", *words)]


def gocanopen(*words: object) -> str:
    """What a command to the node printed."""
    done = subprocess.run(command(*words), capture_output=True, text=True, timeout=PATIENCE, check=True)
    return done.stdout.strip()


@contextmanager
def running(*words: object) -> Iterator[subprocess.Popen[str]]:
    """A command that goes on until its input ends, once it is ready."""
    process = subprocess.Popen(command(*words), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == "ready\n"
        yield process
    finally:
        process.communicate(timeout=PATIENCE)


def say(process: subprocess.Popen[str], line: str) -> str:
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(line + "\n")
    process.stdin.flush()
    return process.stdout.readline().strip()


@contextmanager
def bus(*identifiers: int) -> Iterator[can.BusABC]:
    """vcan0, of which only some identifiers are heard."""
    filters = [can.typechecking.CanFilter(can_id=identifier, can_mask=0x7FF) for identifier in identifiers]
    with can.Bus("vcan0", interface="socketcan", can_filters=filters) as found:
        yield found


def values(code: int) -> list[bytes]:
    """Values of a type as they are on the bus."""
    if code in INTEGERS:
        bits, signed = INTEGERS[code]
        return [value.to_bytes(bits // 8, "little", signed=signed) for value in least_and_most(code)]
    return [SEVEN_O_CLOCK if code in TIMES else struct.pack(REALS[code], -1.5)]


@pytest.mark.parametrize("block", ["", "-block"])
@pytest.mark.parametrize("code", [*INTEGERS, *REALS, *TIMES])
def test_each_data_type_both_ways(code: int, block: str) -> None:
    """Expedited and in segments, and by blocks."""
    for data in values(code):
        assert gocanopen(f"write{block}", f"{FIRST + code:x}", 0, data.hex()) == "done"
        assert gocanopen(f"read{block}", f"{FIRST + code:x}", 0) == data.hex()


@pytest.mark.parametrize("block", ["", "-block"])
def test_text(block: str) -> None:
    assert bytes.fromhex(gocanopen(f"read{block}", "1008", 0)) == b"drivetwin CiA 402"


def domain(data: bytes) -> str:
    """What it tells of a DOMAIN that it writes and reads by blocks."""
    told = command("domain", f"{FIRST + DOMAIN:x}")
    done = subprocess.run(told, input=data, capture_output=True, timeout=MINUTES, check=True)
    return done.stdout.decode().strip()


def test_a_domain_of_more_than_a_megabyte() -> None:
    """Of a length whose lowest byte is 0, which it takes for one that is not told: see the next test."""
    data = LARGE[: len(LARGE) & ~0xFF]
    assert domain(data) == "as written"
    assert large_domain.read(NODE) == data


def test_it_takes_the_lowest_byte_of_a_length_for_all_of_it() -> None:
    """By blocks: the drive tells 257 in four bytes (CiA 301, 7.2.4.3.13), it reads one (`GetBlockSize`, pkg/sdo/client.go)."""
    with bus(0x580 + NODE) as line:
        assert domain(LARGE[:257]).startswith("error: x6070012 ")
        answers = []
        while (frame := line.recv(0)) is not None:
            answers.append(bytes(frame.data))
    index = (FIRST + DOMAIN).to_bytes(2, "little")
    assert bytes([0xC6, *index, 0, 1, 1, 0, 0]) in answers
    assert large_domain.read(NODE) == LARGE[:257]


@pytest.mark.parametrize(
    ("words", "abort"),
    [
        (("read", "7000", 0), "x6020000"),
        (("read", "1018", 9), "x6090011"),
        (("write", "1018", 1, "00000000"), "x6010002"),
        (("write", "6098", 0, "00000000"), "x6070012"),
        (("write", "6081", 0, "00"), "x6070013"),
        (("write", "6086", 0, "0900"), "x6090031"),
        (("write", "6060", 0, "05"), "x6090030"),
    ],
)
def test_sdo_aborts(words: tuple[object, ...], abort: str) -> None:
    assert gocanopen(*words).startswith(f"error: {abort} ")


def test_scan_finds_the_nodes() -> None:
    assert gocanopen("scan").splitlines() == [f"{node} {node} drivetwin CiA 402" for node in (1, 2, 3)]


def test_nmt_commands_are_obeyed() -> None:
    assert gocanopen("write", "1017", 0, "3200") == "done"
    with bus(0x700 + NODE) as heartbeats:
        for name, state in (("start", 5), ("stop", 4), ("pre-operational", 0x7F), ("reset-node", 0)):
            assert gocanopen("nmt", name) == "done"
            seen = None
            while seen != state:
                frame = heartbeats.recv(PATIENCE)
                assert frame is not None
                seen = frame.data[0]


def test_its_node_hears_heartbeats_and_emergencies() -> None:
    """An RPDO that is too short: 8210h."""
    assert gocanopen("write", "1017", 0, "3200") == "done"
    assert gocanopen("write", "1400", 1, "02020000") == "done"
    with bus(0) as line, running("beside", f"{MASTER:x}") as process:
        assert process.stdout is not None
        assert gocanopen("nmt", "start") == "done"
        line.send(can.Message(arbitration_id=0x202, data=b"\0", is_extended_id=False))
        wanted = {f"heartbeat of {NODE}: 5", "emergency 82 8210 11"}
        while wanted:
            told = process.stdout.readline()
            assert told, wanted
            wanted.discard(told.strip())
    assert gocanopen("nmt", "reset-node") == "done"


def test_its_sync_and_time() -> None:
    """TPDO 1 comes at its SYNCs; its TIME is taken, and no emergency told."""
    with bus(0x702) as boot:
        assert gocanopen("nmt", "reset-node") == "done"
        assert boot.recv(PATIENCE) is not None
    for index, subindex, data in (("1800", 2, "01"), ("1800", 1, "82010000")):
        assert gocanopen("write", index, subindex, data) == "done"
    assert gocanopen("nmt", "start") == "done"
    with bus(0x80, 0x82, 0x100, 0x182) as line, running("beside", f"{MASTER:x}"):
        seen: list[int] = []
        while seen.count(0x182) < 5 or seen.count(0x100) < 2:
            frame = line.recv(PATIENCE)
            assert frame is not None
            seen.append(frame.arbitration_id)
    assert 0x82 not in seen
    assert seen.count(0x182) <= seen.count(0x80)


def test_pdo_both_ways(eds: Path) -> None:
    """It reads the EDS of `drivetwin eds`, configures RPDO 1 and TPDO 1, and enables the drive by them."""
    with bus(0) as line, running("pdo", eds) as process:
        assert gocanopen("nmt", "start") == "done"
        for command, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
            assert say(process, f"set 6040 {struct.pack('<H', command).hex()}") == "done"
            told = None
            while told != state:
                line.send(can.Message(arbitration_id=0x80, is_extended_id=False))
                line.recv(0.02)
                told = struct.unpack("<H", bytes.fromhex(say(process, "get 6041")))[0] & 0x6F
    assert gocanopen("nmt", "reset-node") == "done"
