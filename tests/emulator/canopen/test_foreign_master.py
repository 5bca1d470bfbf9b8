"""The library `canopen` as master: a client that this project did not write."""

from __future__ import annotations

import struct

import canopen
import pytest
from canopen_bench import NODE, Bench, Master, foreign_dictionary

from drivetwin.drive_profiles import Access, available_profiles, load_profile
from drivetwin.emulator.canopen import NmtState


def connect(profile: str = "cia402-full") -> tuple[Bench, canopen.RemoteNode]:
    bench = Bench(profile)
    node = Master(bench).add_node(NODE, foreign_dictionary(bench.profile))
    bench.device.power_on()
    return bench, node


@pytest.mark.parametrize("profile", available_profiles())
def test_every_readable_object_is_uploaded_as_it_stands(profile: str) -> None:
    bench, node = connect(profile)
    for variable in bench.od:
        if variable.index == 0x1003 and variable.subindex:
            continue
        theirs = node.sdo.upload(variable.index, variable.subindex)
        assert theirs == variable.encode()


@pytest.mark.parametrize("profile", available_profiles())
def test_every_writable_parameter_comes_back(profile: str) -> None:
    bench, node = connect(profile)
    for variable in bench.od:
        if variable.access is Access.RW and variable.index not in range(0x1000, 0x2000):
            node.sdo.download(variable.index, variable.subindex, variable.encode())
            assert node.sdo.upload(variable.index, variable.subindex) == variable.encode()


def test_values_through_the_foreign_types() -> None:
    bench, node = connect()
    node.sdo["Target position"].raw = -123456
    assert bench.od[0x607A].value == -123456
    node.sdo["Velocity control parameter set"]["Gain"].raw = 0.25
    assert bench.od[0x60F9, 1].value == 0.25
    assert node.sdo["Manufacturer device name"].raw == "drivetwin CiA 402"
    assert node.sdo["Identity object"]["Vendor-ID"].raw == load_profile("cia402-full").vendor_id


@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x6041, 0, b"\x00\x00", 0x06010002),
        (0x2FFF, 0, b"\x00", 0x06020000),
        (0x605A, 0, b"\x09\x00", 0x06090031),
        (0x607A, 0, b"\x00\x00", 0x06070013),
        (0x607A, 0, bytes(9), 0x06070012),
    ],
)
def test_aborts_arrive(index: int, subindex: int, data: bytes, code: int) -> None:
    _, node = connect()
    with pytest.raises(canopen.SdoAbortedError) as abort:
        node.sdo.download(index, subindex, data)
    assert abort.value.code == code


def test_nmt_boot_up_and_heartbeat() -> None:
    bench, node = connect()
    assert node.nmt.state == "PRE-OPERATIONAL"
    node.nmt.state = "OPERATIONAL"
    assert bench.device.nmt.state is NmtState.OPERATIONAL
    node.sdo["Producer heartbeat time"].raw = 20
    beats: list[int] = []
    node.nmt.add_heartbeat_callback(beats.append)
    bench.run_to(0.1)
    assert beats == [5] * 5
    node.nmt.state = "RESET COMMUNICATION"
    assert beats[-1] == 0


def test_remapping_by_save_and_data_both_ways() -> None:
    bench, node = connect("servoone")
    node.tpdo.read()
    node.rpdo.read()
    node.tpdo[1].clear()
    node.tpdo[1].add_variable(0x6064)
    node.tpdo[1].add_variable(0x21A3)
    node.tpdo[1].trans_type = 1
    node.tpdo[1].cob_id = 0x1A0
    node.tpdo[1].enabled = True
    node.tpdo[1].save()
    node.rpdo[2].clear()
    node.rpdo[2].add_variable(0x6040)
    node.rpdo[2].add_variable(0x60C1, 1)
    node.rpdo[2].add_variable(0x60B2)
    node.rpdo[2].trans_type = 1
    node.rpdo[2].enabled = True
    node.rpdo[2].save()
    assert [bench.od[0x1A00, sub].value for sub in range(3)] == [2, 0x6064_0020, 0x21A3_0020]
    node.nmt.state = "OPERATIONAL"

    bench.od[0x6064].value = -5
    bench.od[0x21A3].value = 1.5
    node.rpdo[2][0].raw = 15
    node.rpdo[2][1].raw = 4242
    node.rpdo[2][2].raw = -100
    node.rpdo[2].transmit()
    assert bench.od[0x60C1, 1].value == 0
    node.network.sync.transmit()
    assert (0x1A0, struct.pack("<if", -5, 1.5)) in bench.take()
    assert [node.tpdo[1][k].raw for k in range(2)] == [-5, 1.5]
    assert (bench.od[0x6040].value, bench.od[0x60C1, 1].value, bench.od[0x60B2].value) == (15, 4242, -100)


def test_a_mapping_that_is_too_long_is_refused() -> None:
    _, node = connect()
    node.tpdo.read()
    node.tpdo[1].clear()
    for index in (0x6064, 0x606C, 0x6077):
        node.tpdo[1].add_variable(index)
    with pytest.raises(canopen.SdoAbortedError) as abort:
        node.tpdo[1].save()
    assert abort.value.code == 0x06040042


def test_emergency_arrives() -> None:
    bench, node = connect()
    bench.device.emergency.raise_error(0x7500, 0x11, b"\x01\x02\x03\x04\x05")
    bench.device.emergency.clear()
    first, second = node.emcy.log
    assert (first.code, first.register, first.data) == (0x7500, 0x11, b"\x01\x02\x03\x04\x05")
    assert (second.code, second.register) == (0, 0)
    assert node.emcy.active == []
