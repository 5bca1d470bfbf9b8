"""oze-canopen, a CANopen master in Rust, talks to the nodes 2 and 3 on vcan0 (it has no SDO client for node 1)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import can
import canopen
import pytest
from all_types import FIRST, INTEGERS, REALS, SEVEN_O_CLOCK, TIMES, least_and_most
from oze import oze, read, write
from processes import PATIENCE, emulator

NODE = 2


@pytest.fixture(scope="module", autouse=True)
def _scara(eds_with_types: Path) -> Iterator[None]:
    drives = ("--machine", "scara", "--profile", "cia402-full", "--eds", eds_with_types, "--clock", "sync")
    with emulator(*drives, bus="vcan0"):
        yield


def test_sdo_expedited_and_segmented() -> None:
    assert read(NODE, 0x1000) == struct.pack("<I", 0x20192)
    assert read(NODE, 0x1008) == b"drivetwin CiA 402"
    assert write(NODE, 0x607A, struct.pack("<i", -123456)) == "done"
    assert read(NODE, 0x607A) == struct.pack("<i", -123456)
    assert read(3, 0x607A) == bytes(4)


def a_value(code: int) -> bytes:
    if code in INTEGERS:
        bits, signed = INTEGERS[code]
        return least_and_most(code)[0 if signed else 1].to_bytes(bits // 8, "little", signed=signed)
    return SEVEN_O_CLOCK if code in TIMES else struct.pack(REALS[code], -1.5)


@pytest.mark.parametrize("code", [*INTEGERS, *REALS, *TIMES])
def test_each_data_type_is_read(code: int) -> None:
    """It hands over bytes; of up to four bytes expedited, longer ones in segments."""
    data = a_value(code)
    with can.Bus("vcan0", interface="socketcan") as bus:
        network = canopen.Network(bus)
        network.connect()
        node = network.add_node(NODE, canopen.ObjectDictionary())
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        node.sdo.download(FIRST + code, 0, data)
        assert network.notifier is not None
        network.notifier.stop()
    assert read(NODE, FIRST + code) == data


@pytest.mark.parametrize("code", [code for code in (*INTEGERS, *REALS) if len(a_value(code)) <= 4])
def test_each_data_type_of_up_to_four_bytes_is_written(code: int) -> None:
    assert write(NODE, FIRST + code, a_value(code)) == "done"
    assert read(NODE, FIRST + code) == a_value(code)


def test_its_download_in_segments_never_ends() -> None:
    """Its proto/sdo.rs, download_segment, never sets bit c, 'no more segments' (CiA 301, 7.2.4.3.4): nothing is written."""
    before = read(NODE, FIRST + 0x15)
    assert write(NODE, FIRST + 0x15, bytes(range(8))) == "done"
    assert read(NODE, FIRST + 0x15) == before != bytes(range(8))


@pytest.mark.parametrize(
    ("words", "abort"),
    [
        (("read", "7000", "0"), "ObjectDoesNotExistInObjectDictionary"),
        (("write", "1018", "1", "00000000"), "AttemptToWriteReadOnlyObject"),
    ],
)
def test_sdo_aborts(words: tuple[str, ...], abort: str) -> None:
    assert abort in oze(NODE, *words)


def test_nmt_and_sync() -> None:
    """A heartbeat of 1 ms comes with each SYNC of a drive whose 1006h is 0, and tells the state."""
    write(NODE, 0x1017, b"\x01\x00")
    with can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x700 + NODE, "can_mask": 0x7FF}]) as bus:
        for command, state in (("start", 5), ("stop", 4), ("pre-operational", 0x7F)):
            oze(NODE, "nmt", command)
            oze(NODE, "sync")
            frame = bus.recv(PATIENCE)
            assert frame is not None
            assert frame.data == bytes((state,)), command
        oze(NODE, "nmt", "reset-node")
        frame = bus.recv(PATIENCE)
        assert frame is not None
        assert frame.data == b"\x00"
