"""What is configured wrongly is told: to a foreign master by the abort code that says why, to a user in one line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import can
import canopen
import pytest
from processes import drivetwin

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.dictionary import object_dictionary
from drivetwin.controller.link import Link, PumpedNode
from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

# -- a foreign master's mapping ---------------------------------------------------------------------------------------


@pytest.fixture(params=["servoone", "cia402-full"])
def node(request: pytest.FixtureRequest) -> Iterator[canopen.RemoteNode]:
    """canopen's node of a drive that has booted."""
    profile, machine = load_profile(request.param), load_machine("stage")

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        virtual = VirtualMachine(machine, profile, read_effects(machine.effects_path), SyncClock(), 0, transmit)
        virtual.power_on()
        return virtual

    with Link(InprocBus(connect)) as link:
        node = PumpedNode(1, object_dictionary(profile))
        link.add_node(node)
        yield node


TPDO, RPDO = (0x1801, 0x1A01), (0x1401, 0x1601)
TOO_LONG = (0x6064_0020, 0x606C_0020, 0x6041_0010)


@pytest.mark.parametrize(
    ("pdo", "entries", "code"),
    [
        (TPDO, TOO_LONG, 0x0604_0042),
        (RPDO, (0x60C1_0120, 0x6085_0020, 0x6040_0010), 0x0604_0042),
        (TPDO, (0x6041_0010,) * 9, 0x0609_0011),  # a mapping has eight entries at most
        (TPDO, (0x5FFF_0010,), 0x0602_0000),
        (TPDO, (0x6064_0120,), 0x0609_0011),
        (TPDO, (0x1017_0010,), 0x0604_0041),
        (TPDO, (0x6064_0010,), 0x0604_0041),
        (RPDO, (0x6064_0020,), 0x0604_0041),
        (RPDO, (0x1008_0020,), 0x0604_0041),
    ],
)
def test_a_mapping_that_cannot_be(node: canopen.RemoteNode, pdo: tuple[int, int], entries: tuple[int, ...], code: int) -> None:
    """Disable, write, enable, as CiA 301, 7.5.2.36 and 7.5.2.38 have it; the PDO maps nothing afterwards."""
    communication, mapping = pdo
    node.sdo[communication][1].raw = node.sdo[communication][1].raw | 1 << 31
    node.sdo[mapping][0].raw = 0
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        write_mapping(node, mapping, entries)
    assert refusal.value.code == code
    assert node.sdo[mapping][0].raw == 0


def write_mapping(node: canopen.RemoteNode, index: int, entries: tuple[int, ...]) -> None:
    for subindex, entry in enumerate(entries, start=1):
        node.sdo.download(index, subindex, entry.to_bytes(4, "little"))
    node.sdo[index][0].raw = len(entries)


# -- a user's own EDS -------------------------------------------------------------------------------------------------


def lie(section: str, pattern: str, replacement: str) -> str:
    """The ServoOne's EDS with one thing changed in a section."""
    text = eds_text(load_profile("servoone"), "own.eds")
    found = re.search(rf"(?ms)^\[{section}\]\n.*?(?=^\[|\Z)", text)
    assert found is not None
    changed, count = re.subn(pattern, replacement, found.group())
    assert count
    return text[: found.start()] + changed + text[found.end() :]


def without(section: str) -> str:
    return lie(section, r"(?s).+", "")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (lie("6085", "DataType=.*", "DataType=0x0009"), r"own\.eds, \[6085\]: DataType is 0x0009; expected 0x0007"),
        (lie("6085", "DataType=.*", "DataType=0x0005"), r"own\.eds, \[6085\]: DataType is 0x0005; expected 0x0007 for Quick"),
        (lie("6064", "DataType=.*", "DataType=0x7777"), r"own\.eds, \[6064\]: DataType is 0x7777; expected a code of CiA 301"),
        (lie("6040", "AccessType=.*", "AccessType=perhaps"), r"own\.eds, \[6040\]: AccessType is 'perhaps'; expected"),
        (lie("1A00sub1", "DefaultValue=.*", "DefaultValue=0x60410020"), r"own\.eds, \[1A00sub1\]: maps 6041h with 32 bits"),
        (without("6040"), r"own\.eds lacks objects that a drive which behaves as servoone needs: 6040h; add them"),
        ("<html>not found</html>\n", r"own\.eds is not an EDS or DCF \(CiA 306\)"),
    ],
)
def test_an_eds_that_lies_stops_the_emulator(text: str, complaint: str, tmp_path: Path) -> None:
    eds = tmp_path / "own.eds"
    eds.write_text(text, encoding="ascii")
    ended = drivetwin("emulate", "--machine", "stage", "--bus", "ws://127.0.0.1:0", "--eds", eds)
    assert ended.status == 2
    *warnings, last = ended.err.splitlines()
    assert all("own.eds" in warning for warning in warnings)
    assert last.startswith("drivetwin: ")
    assert re.search(complaint, last), ended.err


def test_an_eds_where_a_profile_is_expected() -> None:
    ended = drivetwin("emulate", "--machine", "stage", "--profile", "own.eds")
    assert ended.status == 2
    assert ended.err.count("\n") == 1
    assert "unknown drive profile 'own.eds'" in ended.err
    assert "for a drive's own file write --eds own.eds" in ended.err
