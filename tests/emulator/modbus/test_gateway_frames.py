"""The CANopen gateway byte by byte: function 43, MEI type 13 (CiA 309-2, clause 5), as a dryve D1 speaks it."""

import struct

import pytest
from modbus_bench import Bench

from drivetwin.emulator.modbus import ModbusService

READ_STATUSWORD = "2B 0D 00 00 00 60 41 00 00 00 00 02"
"""The example of the dryve D1's manual (V2.4, 6.5.5), from byte 7 on."""


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def service(bench: Bench) -> ModbusService:
    return bench.service()


def ask(service: ModbusService, request: str, unit: int = 1) -> str:
    return service.answer(unit, bytes.fromhex(request)).hex(" ").upper()


def test_the_example_of_the_manual(service: ModbusService) -> None:
    # 'switch on disabled'; data are low byte first, all before them is high byte first
    assert ask(service, READ_STATUSWORD) == "2B 0D 00 00 00 60 41 00 00 00 00 02 50 02"
    assert ask(service, READ_STATUSWORD, unit=0) == ask(service, READ_STATUSWORD)  # what that manual sends


BYTES = [
    pytest.param("00 00 00 10 00 00 00 00 00 04", "00 00 00 10 00 00 00 00 00 04 92 01 02 00", id="UNSIGNED32"),
    pytest.param("00 00 00 10 01 00 00 00 00 01", "00 00 00 10 01 00 00 00 00 01 00", id="UNSIGNED8"),
    pytest.param("00 00 00 10 01 00 00 00 00 04", "00 00 00 10 01 00 00 00 00 01 00", id="fewer bytes than asked for"),
    pytest.param("00 00 00 10 00 00 00 00 00 00", "00 00 00 10 00 00 00 00 00 04 92 01 02 00", id="0: all of it"),
    pytest.param("00 00 01 10 00 00 00 00 00 04", "00 00 01 10 00 00 00 00 00 04 92 01 02 00", id="node-ID said"),
    pytest.param("00 5A 00 10 01 00 00 00 00 01", "00 5A 00 10 01 00 00 00 00 01 00", id="the second option byte comes back"),
    pytest.param("00 00 00 10 00 00 00 01 00 02", "00 00 00 10 00 00 00 01 00 02 01 02", id="a part of it"),
    pytest.param("00 00 00 10 00 00 00 04 00 02", "00 00 00 10 00 00 00 04 00 00", id="nothing after its end"),
    pytest.param("01 00 00 60 60 00 00 00 00 01 03", "01 00 00 60 60 00 00 00 00 00", id="write INTEGER8"),
    pytest.param("01 00 00 60 40 00 00 00 00 02 06 00", "01 00 00 60 40 00 00 00 00 00", id="write UNSIGNED16"),
    pytest.param("01 00 00 60 7A 00 00 00 00 04 FF FF FF FF", "01 00 00 60 7A 00 00 00 00 00", id="write INTEGER32"),
]


@pytest.mark.parametrize(("request_", "response"), BYTES)
def test_bytes(service: ModbusService, request_: str, response: str) -> None:
    assert ask(service, "2B 0D " + request_) == "2B 0D " + response


ABORTS = [
    pytest.param("00 00 00 60 7D 09 00 00 00 04", "06 09 00 11", id="no such sub-index"),
    pytest.param("00 00 00 20 FF 00 00 00 00 04", "06 02 00 00", id="no such object"),
    pytest.param("01 00 00 60 41 00 00 00 00 02 00 00", "06 01 00 02", id="read-only"),
    pytest.param("01 00 00 60 7D 00 00 00 00 01 02", "06 01 00 02", id="constant number of sub-indices"),
    pytest.param("01 00 00 60 40 00 00 00 00 01 06", "06 07 00 13", id="too short"),
    pytest.param("01 00 00 60 60 00 00 00 00 02 03 00", "06 07 00 12", id="too long"),
    pytest.param("01 00 00 60 5A 00 00 00 00 02 63 00", "06 09 00 31", id="too high"),
    pytest.param("01 00 00 60 60 00 00 00 00 01 05", "06 09 00 30", id="no such mode"),
    pytest.param("01 00 00 60 7A 00 00 01 00 03 00 00 00", "06 01 00 00", id="a part cannot be written"),
    pytest.param("00 00 00 10 00 00 00 05 00 01", "06 07 00 12", id="begins after the end"),
]


@pytest.mark.parametrize(("request_", "abort"), ABORTS)
def test_aborts(service: ModbusService, request_: str, abort: str) -> None:
    assert ask(service, "2B 0D " + request_) == "AB FF 00 06 0D CE " + abort


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        pytest.param("2B", "03", id="no MEI type"),
        pytest.param("2B 0D 00 00 00 60 41 00 00 00 00", "03", id="a byte missing"),
        pytest.param("2B 0D 00 00 00 60 41 00 00 00 00 02 00", "03", id="a read with data"),
        pytest.param("2B 0D 01 00 00 60 40 00 00 00 00 02 06", "03", id="a write with less data than it says"),
        pytest.param("2B 0D 02 00 00 60 40 00 00 00 00 00", "03", id="neither read nor write"),
        pytest.param("2B 0E 01 00", "01", id="MEI type 14"),
        pytest.param("2B 0D 00 00 07 60 41 00 00 00 00 02", "0B", id="no such node"),
    ],
)
def test_telegrams_that_are_none(service: ModbusService, request_: str, code: str) -> None:
    assert ask(service, request_) == f"AB {code}"


def test_node_id_0_means_the_unit_identifier_selects_the_drive() -> None:
    bench = Bench(machine="scara")
    service = bench.service()
    for unit in (1, 2, 3):
        serial_number = ask(service, "2B 0D 00 00 00 10 18 04 00 00 00 04", unit)
        assert serial_number.endswith(f"04 {unit:02X} 00 00 00")
        said = ask(service, f"2B 0D 00 00 {unit:02X} 10 18 04 00 00 00 04", unit=0)
        assert said.endswith(f"{unit:02X} 10 18 04 00 00 00 04 {unit:02X} 00 00 00")
    assert ask(service, "2B 0D 00 00 00 10 18 04 00 00 00 04", unit=9) == "AB 0B"


def test_a_long_value_in_parts(bench: Bench, service: ModbusService) -> None:
    name = str(bench.od[0x1008].value).encode()
    parts = b""
    while len(parts) < len(name):
        answer = service.answer(1, struct.pack(">BBBBBHBHH", 0x2B, 0x0D, 0, 0, 0, 0x1008, 0, len(parts), 5))
        assert answer[12:] == name[len(parts) : len(parts) + 5]
        parts += answer[12:]
    assert parts == name


def test_what_is_written_here_is_read_there(bench: Bench, service: ModbusService) -> None:
    """One dictionary: the gateway, the registers and SDO see the same objects."""
    assert ask(service, "2B 0D 01 00 00 60 81 00 00 00 00 04 44 33 22 11") == "2B 0D 01 00 00 60 81 00 00 00 00 00"
    assert service.answer(1, bytes.fromhex("03 0200 0002")) == bytes.fromhex("03 04 11223344")
    assert bench.sdo_write(0x6081, 0, 77, 4) == 0
    assert ask(service, "2B 0D 00 00 00 60 81 00 00 00 00 04").endswith("04 4D 00 00 00")
