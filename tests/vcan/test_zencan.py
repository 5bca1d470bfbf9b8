"""zencan-cli, a CANopen master in Rust, talks to one node on vcan0: SDO, PDO parameters, NMT, SYNC.

The emulator has the clock `sync`: SDO and NMT are answered at once, and nothing else moves.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from processes import emulator
from zencan import Dump, value, zencan

DRIVES = ("--profile", "cia402-full", "--clock", "sync")
TEXT = 0x2F00
"""Of the EDS with a text."""


@pytest.fixture(scope="module")
def arm(eds_with_text: Path) -> Iterator[None]:
    """One emulator for the tests that only talk: node 1."""
    with emulator("--machine", "arm", *DRIVES, "--eds", eds_with_text, bus="vcan0"):
        yield


@pytest.fixture
def fresh(arm: None) -> None:  # noqa: ARG001
    """Node 1 with its power-on values."""
    zencan("nmt reset-app 1")


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize(
    ("address", "data_type", "written"),
    [
        ("0x6098 0", "i8", "-3"),
        ("0x6071 0", "i16", "-1000"),
        ("0x607A 0", "i32", "-123456"),
        ("0x607E 0", "u8", "192"),
        ("0x6066 0", "u16", "65535"),
        ("0x6081 0", "u32", "4294967294"),
        ("0x60F9 1", "f32", "1.5"),
    ],
)
def test_expedited_transfers_of_each_type(address: str, data_type: str, written: str) -> None:
    assert re.fullmatch(r"Wrote [124] bytes\n", zencan(f"write 1 {address} {data_type} {written}"))
    assert value(1, address, data_type) == written


@pytest.mark.usefixtures("fresh")
def test_segmented_transfers() -> None:
    note = "a text of more than one segment, written and read by zencan"
    assert value(1, "0x1008 0", "utf8") == "drivetwin CiA 402"
    assert zencan(f"write 1 {TEXT:#x} 0 utf8 '{note}'") == f"Wrote {len(note)} bytes\n"
    assert value(1, f"{TEXT:#x} 0", "utf8") == note


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize(
    ("command", "abort"),
    [
        ("read 1 0x7000 0", "NoSuchObject"),
        ("read 1 0x1018 9", "NoSuchSubIndex"),
        ("write 1 0x1018 1 u32 4", "ReadOnly"),
        ("write 1 0x6098 0 u32 4", "DataTypeMismatchLengthHigh"),
        ("write 1 0x6081 0 u8 4", "DataTypeMismatchLengthLow"),
        ("write 1 0x6086 0 i16 9", "ValueTooHigh"),
        ("write 1 0x6060 0 i8 5", "InvalidValue"),
        ("write 1 0x1600 1 u32 0x60400010", "CantStoreDeviceState"),
    ],
)
def test_aborts_have_the_code_that_it_reads(command: str, abort: str) -> None:
    assert zencan(command).rstrip().endswith(f": {abort}")


@pytest.mark.usefixtures("fresh")
def test_pdo_configuration_is_read_and_loaded(tmp_path: Path) -> None:
    """A configuration file of its own format; then what it scans is what it has loaded."""
    config = tmp_path / "node.toml"
    config.write_text(
        "[tpdo.1]\nenabled = true\ncob_id = 0x2A1\ntransmission_type = 3\n"
        "mappings = [{index = 0x6064, sub = 0, size = 32}, {index = 0x6077, sub = 0, size = 16}]\n"
        "[rpdo.3]\nenabled = true\ncob_id = 0x511\ntransmission_type = 1\n"
        "mappings = [{index = 0x60FF, sub = 0, size = 32}]\n"
        '[[store]]\nindex = 0x6081\nsub = 0\ntype = "u32"\nvalue = 4711\n'
    )
    before = pdos(zencan("scan-pdo-config 1"))
    assert before["TPDO1"] == ("false", "Std(0x281)", "255", ["0x6041/0/16", "0x6061/0/8"])
    assert zencan(f"load-config 1 {config}") == ""
    after = pdos(zencan("scan-pdo-config 1"))
    assert value(1, "0x6081 0", "u32") == "4711"
    changed = {
        "TPDO1": ("true", "Std(0x2a1)", "3", ["0x6064/0/32", "0x6077/0/16"]),
        "RPDO3": ("true", "Std(0x511)", "1", ["0x60ff/0/32"]),
    }
    assert after == before | changed


def pdos(printed: str) -> dict[str, tuple[str, str, str, list[str]]]:
    """By the name that zencan gives a PDO, counted from 0: valid, COB-ID, transmission type, mapping."""
    found = {}
    for name, text in re.findall(r"^([TR]PDO\d):\n(.*?)(?=^\S|\Z)", printed, re.MULTILINE | re.DOTALL):
        head = re.search(r"valid=(\w+), COB=(\S+), transmission_type=(\d+)", text)
        assert head is not None, text
        mapped = re.findall(r"index=(\w+), sub=(\d+), size=(\d+)", text)
        found[name] = (head[1], head[2], head[3], ["/".join(entry) for entry in mapped])
    assert len(found) == 8, printed
    return found


@pytest.mark.usefixtures("fresh")
def test_nmt_commands_are_obeyed(tmp_path: Path) -> None:
    """Each SYNC of 1 ms brings a heartbeat, which tells the state; a stopped node answers no SDO."""
    with Dump(tmp_path / "dump") as dump:
        heartbeat(dump)
        for command, state in (("start all", "Operational"), ("stop 1", "Stopped")):
            zencan(f"nmt {command}")
            zencan("sync")
            dump.until(f"Heartbeat {{ node: 1, toggle: false, state: {state} }}")
        assert "Timeout" in zencan("read 1 0x1000 0")
        for command in ("reset-comms 1", "reset-app all"):
            dump.forget()
            zencan(f"nmt {command}")
            dump.until("Heartbeat { node: 1, toggle: false, state: Bootup }")
        assert value(1, "0x1000 0", "u32") == str(0x20192)


@pytest.mark.usefixtures("fresh")
def test_sync_with_and_without_counter(tmp_path: Path) -> None:
    """Each SYNC is a cycle; a counter that nobody asked for is the error 8240h, and none where 1019h asks for it."""
    with Dump(tmp_path / "dump") as dump:
        heartbeat(dump)
        for command, emergencies in (("sync", 0), ("sync 7", 1)):
            dump.forget()
            assert zencan(command) == "SYNC sent\n"
            dump.until("Heartbeat")
            assert dump.seen().count("data: [64, 130, ") == emergencies
        zencan("write 1 0x1019 0 u8 10")
        dump.forget()
        zencan("sync 8")
        dump.until("Heartbeat")
        assert "data: [64, 130, " not in dump.seen()


def heartbeat(dump: Dump) -> None:
    """One heartbeat a cycle of 1 ms."""
    zencan("write 1 0x1017 0 u16 1")
    zencan("sync")
    dump.until("Heartbeat { node: 1, toggle: false, state: PreOperational }")
