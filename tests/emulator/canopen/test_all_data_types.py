"""Every data type of CiA 301, table 44, from an EDS to the bus and back, with `canopen` as the master."""

from __future__ import annotations

import struct
from pathlib import Path

import canopen
import pytest
from all_types import FIRST, INTEGERS, REALS, SEVEN_O_CLOCK, TIMES, least_and_most, write_eds
from canopen_bench import NODE, Bench, Master

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.emulator.canopen import AbortCode, SdoAbort


@pytest.fixture(scope="module")
def eds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_eds(tmp_path_factory.mktemp("eds") / "types.eds")


@pytest.fixture
def bench(eds: Path) -> Bench:
    return Bench(profile_from_eds(eds, load_profile("cia402-full"))).boot()


@pytest.fixture
def node(bench: Bench, eds: Path) -> canopen.RemoteNode:
    return Master(bench).add_node(NODE, str(eds))


@pytest.mark.parametrize("code", INTEGERS)
@pytest.mark.parametrize("end", ["least", "most"])
def test_integers_to_their_ends(node: canopen.RemoteNode, code: int, end: str) -> None:
    bits, signed = INTEGERS[code]
    value = least_and_most(code)[end == "most"]
    assert node.sdo[FIRST + code].raw == 1
    node.sdo[FIRST + code].raw = value
    assert node.sdo[FIRST + code].raw == value
    assert node.sdo.upload(FIRST + code, 0) == value.to_bytes(bits // 8, "little", signed=signed)


@pytest.mark.parametrize("code", REALS)
def test_reals(node: canopen.RemoteNode, code: int) -> None:
    node.sdo[FIRST + code].raw = -1.5e30
    assert node.sdo.upload(FIRST + code, 0) == struct.pack(REALS[code], -1.5e30)


def test_not_a_number_is_refused(node: canopen.RemoteNode) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        node.sdo.download(FIRST + 0x11, 0, struct.pack("<d", float("nan")))
    assert refusal.value.code == 0x06090030


@pytest.mark.parametrize("code", TIMES)
def test_times_are_six_bytes(node: canopen.RemoteNode, code: int) -> None:
    node.sdo.download(FIRST + code, 0, SEVEN_O_CLOCK)
    assert node.sdo.upload(FIRST + code, 0) == SEVEN_O_CLOCK


@pytest.mark.parametrize("code", [*INTEGERS, *REALS, *TIMES])
def test_another_length_is_refused(node: canopen.RemoteNode, code: int) -> None:
    length = len(node.sdo.upload(FIRST + code, 0))
    for wrong, abort in ((length - 1, 0x06070013), (length + 1, 0x06070012)):
        if wrong == 0:
            continue
        with pytest.raises(canopen.SdoAbortedError) as refusal:
            node.sdo.download(FIRST + code, 0, bytes(wrong))
        assert refusal.value.code == abort


@pytest.mark.parametrize(
    ("codes", "values"),
    [
        ((0x10, 0x12), (-8_388_608, -(1 << 39))),
        ((0x16, 0x18), (0xABCDEF, 0x1234567890)),
        ((0x14, 0x05), (-2, 200)),
        ((0x11,), (0.1,)),
    ],
)
def test_they_stand_in_pdos(node: canopen.RemoteNode, codes: tuple[int, ...], values: tuple[int | float, ...]) -> None:
    """What RPDO 2 brought at one SYNC TPDO 2 tells at the next, packed and read by `canopen`."""
    node.tpdo.read()
    node.rpdo.read()
    for pdo in (node.rpdo[2], node.tpdo[2]):
        pdo.clear()
        for code in codes:
            pdo.add_variable(FIRST + code)
        pdo.trans_type = 1
        pdo.enabled = True
        pdo.save()
    node.nmt.state = "OPERATIONAL"
    for place, value in enumerate(values):
        node.rpdo[2][place].raw = value
    node.rpdo[2].transmit()
    node.network.sync.transmit()
    node.network.sync.transmit()
    assert tuple(node.tpdo[2][place].raw for place in range(len(codes))) == values


def test_a_dummy_stands_beside_an_integer_of_three_bytes(bench: Bench) -> None:
    bench.map_pdo(0x1400, (0x0005_0008, (FIRST + 0x16) << 16 | 24), 255)
    bench.nmt(b"\x01")
    bench.device.receive(0x200 + NODE, bytes.fromhex("FF 03 02 01"))
    assert bench.od[FIRST + 0x16].value == 0x010203


def test_a_mapping_with_another_length_is_refused(bench: Bench) -> None:
    with pytest.raises(SdoAbort) as refusal:
        bench.map_pdo(0x1400, ((FIRST + 0x10) << 16 | 32,), 255)
    assert refusal.value.code is AbortCode.NOT_MAPPABLE


def test_a_written_eds_has_them(eds: Path) -> None:
    profile = profile_from_eds(eds, load_profile("cia402-full"))
    again = eds.with_name("again.eds")
    again.write_text(eds_text(profile, again.name), encoding="utf-8")
    theirs = canopen.import_od(str(again), NODE)
    for code in INTEGERS:
        entry = theirs[FIRST + code]
        assert isinstance(entry, canopen.objectdictionary.ODVariable)
        assert (entry.data_type, entry.default) == (code, 1)
