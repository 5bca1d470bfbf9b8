"""The library `canopen` as master of one node on vcan0, service by service: SDO, PDO, NMT, guarding, EMCY, SYNC, TIME, LSS."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import canopen
import pytest
from canopen.lss import LssMaster
from modes_402 import reset_node
from processes import PATIENCE, emulator

TEXT = 0x2F00
"""Of the EDS with a text."""

IDENTITY = (0, 0x402, 0x10000, 1)


@pytest.fixture(scope="module")
def arm(eds_with_text: Path) -> Iterator[Path]:
    """One emulator for all tests: node 1, with the objects of the EDS that is yielded."""
    drives = ("--profile", "cia402-full", "--eds", eds_with_text, "--clock", "sync")
    with emulator("--machine", "arm", *drives, bus="vcan0"):
        yield eds_with_text


@pytest.fixture
def node(arm: Path) -> Iterator[canopen.RemoteNode]:
    """Node 1 after a reset, with the dictionary that `canopen` reads in the EDS."""
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    try:
        node = network.add_node(1, str(arm))
        node.sdo.RESPONSE_TIMEOUT = PATIENCE
        reset_node(node)
        yield node
    finally:
        network.disconnect()


def test_sdo_expedited_and_segmented(node: canopen.RemoteNode) -> None:
    note = "a text of more than one segment, written and read by canopen"
    node.sdo["Target position"].raw = -123456
    node.sdo["Velocity control parameter set"]["Gain"].raw = 1.5
    node.sdo["Note"].raw = note
    assert node.sdo["Target position"].raw == -123456
    assert node.sdo["Velocity control parameter set"]["Gain"].raw == 1.5
    assert node.sdo["Note"].raw == note


@pytest.mark.parametrize("size", [1, 7, 889, 890, 2000])
def test_sdo_block_transfer(node: canopen.RemoteNode, size: int) -> None:
    """Of one segment, of a full block of 127, of one more, of three blocks."""
    text = bytes(33 + k % 90 for k in range(size))
    with node.sdo[TEXT].open("wb", size=size, block_transfer=True) as file:
        file.write(text)
    with node.sdo[TEXT].open("rb", block_transfer=True) as file:
        assert file.read() == text


@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x7000, 0, b"\x00", 0x06020000),
        (0x1018, 9, b"\x00", 0x06090011),
        (0x1018, 1, bytes(4), 0x06010002),
        (0x6098, 0, bytes(4), 0x06070012),
        (0x6081, 0, b"\x00", 0x06070013),
        (0x6086, 0, b"\x09\x00", 0x06090031),
        (0x6060, 0, b"\x05", 0x06090030),
    ],
)
def test_sdo_aborts(node: canopen.RemoteNode, index: int, subindex: int, data: bytes, code: int) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        node.sdo.download(index, subindex, data)
    assert refusal.value.code == code


def test_nmt_and_heartbeat(node: canopen.RemoteNode) -> None:
    """A heartbeat a SYNC tells the state that each command brings."""
    node.sdo[0x1017].raw = 1
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        node.nmt.state = state
        heartbeats: list[int] = []
        node.nmt.add_heartbeat_callback(heartbeats.append)
        node.network.sync.transmit()
        await_number(heartbeats, 1)
        assert node.nmt.state == state


def test_node_guarding(node: canopen.RemoteNode) -> None:
    """Its requests by remote frame are answered with the state beside a bit that alternates."""
    answers: list[int] = []
    node.network.subscribe(0x701, lambda _id, data, _time: answers.append(data[0]))
    node.nmt.start_node_guarding(0.05)
    await_true(lambda: len(answers) >= 4)
    node.nmt.stop_node_guarding()
    assert answers[:4] == [0x7F, 0xFF, 0x7F, 0xFF]
    assert node.nmt.state == "PRE-OPERATIONAL"


def test_pdo_both_ways(node: canopen.RemoteNode) -> None:
    """Remapped by its own `save`; what RPDO 2 brought at one SYNC, TPDO 2 tells at the next."""
    node.tpdo.read()
    node.rpdo.read()
    for pdo in (node.rpdo[2], node.tpdo[2]):
        pdo.clear()
        pdo.add_variable(0x607A)
        pdo.add_variable(0x60B2)
        pdo.trans_type = 1
        pdo.enabled = True
        pdo.save()
    node.nmt.state = "OPERATIONAL"
    told: list[tuple[int, int]] = []
    node.tpdo[2].add_callback(lambda pdo: told.append((pdo[0].raw, pdo[1].raw)))
    node.rpdo[2][0].raw, node.rpdo[2][1].raw = -123456, 77
    node.rpdo[2].transmit()
    for count in (1, 2):
        node.network.sync.transmit()
        await_number(told, count)
    assert told == [(0, 0), (-123456, 77)]


def test_emergency(node: canopen.RemoteNode) -> None:
    """8240h for a SYNC with a counter that nobody asked for; no more of it at one without."""
    node.network.sync.transmit(1)
    await_true(lambda: len(node.emcy.active) == 1)
    assert node.emcy.active[0].code == 0x8240
    assert node.sdo["Pre-defined error field"][1].raw & 0xFFFF == 0x8240
    node.network.sync.transmit()
    await_true(lambda: not node.emcy.active)


def test_time_is_taken_without_complaint(node: canopen.RemoteNode) -> None:
    """TIME has no answer: the node goes on, and has told no error."""
    node.network.time.transmit(1_000_000_000)
    assert node.sdo[0x1012].raw == 0x8000_0100
    assert node.emcy.log == []


def test_lss(node: canopen.RemoteNode) -> None:
    """Select and inquire; without a node-ID it is found by fastscan, and gets one."""
    lss = node.network.lss
    lss.RESPONSE_TIMEOUT = 0.5
    assert lss.fast_scan() == (False, None)
    assert lss.send_switch_state_selective(*IDENTITY)
    assert tuple(lss.inquire_lss_address(command) for command in range(0x5A, 0x5E)) == IDENTITY
    assert lss.inquire_node_id() == 1
    lss.configure_bit_timing(2)
    lss.configure_node_id(0xFF)
    lss.send_switch_state_global(LssMaster.WAITING_STATE)
    node.nmt.state = "RESET COMMUNICATION"
    assert lss.fast_scan() == (True, list(IDENTITY))
    lss.configure_node_id(1)
    lss.send_switch_state_global(LssMaster.WAITING_STATE)
    assert struct.unpack("<I", node.sdo.upload(0x1000, 0)) == (0x20192,)


def await_number(heard: list[Any], number: int) -> None:
    await_true(lambda: len(heard) >= number)


def await_true(condition: Callable[[], bool]) -> None:
    """Wait for a condition, for as long as a loaded machine may need."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)
