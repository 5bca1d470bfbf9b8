"""zencan-cli finds nodes, gives them IDs by LSS and has them store: each test with an emulator, or two, of its own on vcan0."""

from __future__ import annotations

import re
from pathlib import Path

from processes import emulator
from zencan import Dump, value, zencan

DRIVES = ("--profile", "cia402-full", "--clock", "sync")
IDENTITY = "0x0 0x402 0x10000"
"""Vendor, product, revision of every node; the serial number is the node-ID."""

FASTSCAN_WAIT = 100
"""Time that a fastscan waits for each bit [ms]."""


def test_scan_finds_the_nodes_and_their_identity() -> None:
    with emulator("--machine", "scara", *DRIVES, bus="vcan0"):
        found = zencan("scan")
    assert re.findall(r"Node (\d+): .*\n +Identity (.*)\n +Device Name: (.*)\n +Versions: (.*)", found) == [
        (str(node), f"vendor: 0, product: 402, revision: 10000, serial: {node}", "'drivetwin CiA 402'", "'1' SW, 'virtual' HW")
        for node in (1, 2, 3)
    ]


def test_lss_selects_assigns_and_stores(tmp_path: Path) -> None:
    """A node-ID set by LSS is the node's after reset communication, and after a power cycle where it was stored."""
    machine = ("--machine", "scara", *DRIVES, "--store", tmp_path)
    with emulator(*machine, bus="vcan0"):
        assert zencan(f"lss activate {IDENTITY} 0x77") == "Error: Timed out waiting for LSS response\n"
        assert zencan(f"lss activate {IDENTITY} 2") == "Success!\n"
        assert zencan("lss set-node-id 0x20") == "Success!\n"
        assert zencan(f"lss store-config {IDENTITY} 2").endswith("Success!\n")
        assert zencan("lss global 0") == "Commanding global Waiting\n"
        assert value(2, "0x1018 4", "u32") == "2"
        zencan("nmt reset-comms 2")
        assert value(0x20, "0x1000 0", "u32") == str(0x20192)
    with emulator(*machine, bus="vcan0"):
        assert value(0x20, "0x1000 0", "u32") == str(0x20192)
        assert "Timeout" in zencan("read 2 0x1000 0")


def test_lss_fastscan_finds_the_node_without_an_id() -> None:
    with emulator("--machine", "scara", *DRIVES, bus="vcan0"):
        assert zencan("lss fastscan 5") == "Found 0 unconfigured nodes\n"
        assert zencan(f"lss set-node-id 0xFF {IDENTITY} 3") == "Success!\n"
        zencan("lss global 0")
        zencan("nmt reset-comms 3")
        assert zencan(f"lss fastscan {FASTSCAN_WAIT}") == f"Found 1 unconfigured nodes\n{IDENTITY} 0x3\n"
        assert zencan(f"lss set-node-id 0x21 {IDENTITY} 3") == "Success!\n"
        zencan("lss global 0")
        assert value(0x21, "0x1000 0", "u32") == str(0x20192)




def test_store_survives_the_process(tmp_path: Path) -> None:
    """By 1010h and 1011h. Its own `save-objects` says 'evas' (73617665h) where CiA 301, 7.5.2.13, wants 'save': 0800 0020h."""
    store = ("--store", tmp_path / "store")
    with emulator("--machine", "arm", *DRIVES, *store, bus="vcan0"), Dump(tmp_path / "dump") as dump:
        shipped = value(1, "0x6081 0", "u32")
        zencan("write 1 0x6081 0 u32 4711")
        assert zencan("save-objects 1").endswith("object 0x1010sub1: CantStore\n")
        dump.until("index: 4112, sub: 1, data: [101, 118, 97, 115]")
        assert zencan("write 1 0x1010 1 u32 0x65766173") == "Wrote 4 bytes\n"
    with emulator("--machine", "arm", *DRIVES, *store, bus="vcan0"):
        assert value(1, "0x6081 0", "u32") == "4711"
        assert zencan("write 1 0x1011 1 u32 0x64616F6C") == "Wrote 4 bytes\n"
        zencan("nmt reset-app 1")
        assert value(1, "0x6081 0", "u32") == shipped
