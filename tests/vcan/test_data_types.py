"""Every data type of a fixed length on vcan0, as `canopen` of Python and `canopen` of npm write and read it."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

import canopen
import large_domain
import pytest
from all_types import FIRST, INTEGERS, LARGE, MINUTES, REALS, SEVEN_O_CLOCK, TIMES, least_and_most
from npm import seen
from processes import PATIENCE, emulator


@pytest.fixture(scope="module")
def arm(eds_with_types: Path) -> Iterator[Path]:
    """Node 1 with an object of each type."""
    drives = ("--profile", "cia402-full", "--eds", eds_with_types, "--clock", "sync")
    with emulator("--machine", "arm", *drives, bus="vcan0"):
        yield eds_with_types


def test_canopen_of_python(arm: Path) -> None:
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    try:
        node = network.add_node(1, str(arm))
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        for code in INTEGERS:
            for value in least_and_most(code):
                node.sdo[FIRST + code].raw = value
                assert node.sdo[FIRST + code].raw == value, hex(code)
        for code, layout in REALS.items():
            node.sdo[FIRST + code].raw = -1.5
            assert node.sdo.upload(FIRST + code, 0) == struct.pack(layout, -1.5)
        for code in TIMES:
            node.sdo.download(FIRST + code, 0, SEVEN_O_CLOCK)
            assert node.sdo.upload(FIRST + code, 0) == SEVEN_O_CLOCK
    finally:
        network.disconnect()


def test_canopen_of_npm(arm: Path) -> None:
    """It has no 56 bits: its type_to_raw.js makes eight bytes of them, which the drive refuses as too long (0607 0012h)."""
    told = seen("types", arm)
    names = {"INTEGER8", "INTEGER16", "INTEGER24", "INTEGER32", "INTEGER40", "INTEGER48", "INTEGER64", "REAL32", "REAL64"}
    names |= {name.replace("INTEGER", "UNSIGNED") for name in names if name.startswith("I")} | set(TIMES.values())
    assert set(told["faithful"]) == names
    assert told["refused"] == {"INTEGER56": "6070012", "UNSIGNED56": "6070012"}


def test_a_domain_of_more_than_a_megabyte_by_canopen_of_npm(arm: Path, tmp_path: Path) -> None:
    """Written by blocks. To read such a one it copies all that it has with each segment (sdo_client.js, `Buffer.concat`)."""
    file = tmp_path / "large"
    file.write_bytes(LARGE)
    assert seen("domain", arm, file, patience=MINUTES) == {"length": len(LARGE)}
    assert large_domain.read(1) == LARGE
