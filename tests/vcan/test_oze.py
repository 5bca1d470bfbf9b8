"""oze-canopen, a CANopen master in Rust, talks to the nodes 2 and 3 on vcan0 (it has no SDO client for node 1)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import can
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


@pytest.mark.parametrize("code", [*INTEGERS, *REALS, *TIMES])
def test_each_data_type(code: int) -> None:
    """It hands over bytes; of up to four bytes expedited, longer ones in segments."""
    if code in INTEGERS:
        bits, signed = INTEGERS[code]
        data = least_and_most(code)[0 if signed else 1].to_bytes(bits // 8, "little", signed=signed)
    else:
        data = SEVEN_O_CLOCK if code in TIMES else struct.pack(REALS[code], -1.5)
    assert write(NODE, FIRST + code, data) == "done"
    assert read(NODE, FIRST + code) == data


@pytest.mark.parametrize(
    ("words", "abort"),
    [
        (("read", "7000", "0"), "ObjectDoesNotExistInTheObjectDictionary"),
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
