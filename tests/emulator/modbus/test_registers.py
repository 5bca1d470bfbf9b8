"""Registers: functions 3, 4, 6, 16, 23 of the MODBUS Application Protocol V1.1b3 on a drive's objects."""

import struct

import pytest
from modbus_bench import (
    CONTROLWORD,
    ENABLE,
    HOMING_METHOD,
    MODE,
    PROFILE_VELOCITY,
    SHUTDOWN,
    STATUSWORD,
    SWITCH_ON,
    TARGET_POSITION,
    TARGET_VELOCITY,
    Bench,
)

from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.modbus_map import load_modbus_map
from drivetwin.emulator.canopen import ObjectDictionary
from drivetwin.emulator.modbus import ModbusService
from drivetwin.emulator.modbus.exception_codes import ModbusException
from drivetwin.emulator.modbus.registers import Registers

FUNCTION, ADDRESS, VALUE, BUSY, NO_TARGET = 1, 2, 3, 6, 0x0B


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def service(bench: Bench) -> ModbusService:
    return bench.service()


def refused(function: int, code: int) -> bytes:
    return bytes((function | 0x80, code))


def read(function: int, address: int, count: int) -> bytes:
    return struct.pack(">BHH", function, address, count)


def write(address: int, *words: int) -> bytes:
    return struct.pack(f">BHHB{len(words)}H", 16, address, len(words), 2 * len(words), *words)


def write_one(address: int, word: int) -> bytes:
    return struct.pack(">BHH", 6, address, word)


@pytest.mark.parametrize("function", [3, 4])
def test_a_32_bit_value_is_two_registers_high_word_first(bench: Bench, service: ModbusService, function: int) -> None:
    bench.od[0x607A].write(-2)
    bench.od[0x60FF].write(0x12345678)
    answer = service.answer(1, read(function, TARGET_POSITION, 4))
    assert answer == bytes((function, 8)) + bytes.fromhex("FFFF FFFE 1234 5678")


def test_8_bit_values_take_a_register_with_their_sign(bench: Bench, service: ModbusService) -> None:
    bench.od[0x6098].write(-1)
    assert service.answer(1, read(3, HOMING_METHOD, 1)) == bytes.fromhex("03 02 FFFF")
    assert service.answer(1, write_one(HOMING_METHOD, 0xFFFD)) == write_one(HOMING_METHOD, 0xFFFD)
    assert bench.od[0x6098].value == -3
    assert service.answer(1, write_one(HOMING_METHOD, 200)) == refused(6, VALUE)  # beyond INTEGER8
    assert bench.od[0x6098].value == -3


def test_torque_is_a_float_in_two_registers(service: ModbusService, bench: Bench) -> None:
    answer = service.answer(1, read(4, 0x0108, 2))
    assert answer[:2] == b"\x04\x04"
    assert struct.unpack(">f", answer[2:])[0] == pytest.approx(float(bench.od[0x21A3].read()))


def test_half_an_object_can_be_read_but_not_written(bench: Bench, service: ModbusService) -> None:
    bench.od[0x607A].write(0x00010002)
    assert service.answer(1, read(3, TARGET_POSITION + 1, 1)) == bytes.fromhex("03 02 0002")
    for pdu in (
        write_one(TARGET_POSITION, 7),
        write_one(TARGET_POSITION + 1, 7),
        write(TARGET_POSITION + 1, 7),
        write(TARGET_POSITION, 0, 1, 0),  # the next object's high word only
    ):
        assert service.answer(1, pdu) == refused(pdu[0], ADDRESS)
    assert bench.od[0x607A].value == 0x00010002


def test_many_registers_are_written_whole_and_in_one(bench: Bench, service: ModbusService) -> None:
    assert service.answer(1, write(CONTROLWORD, SHUTDOWN, 8, 0xFFFF, 0xFF00, 0, 500)) == struct.pack(">BHH", 16, CONTROLWORD, 6)
    values = [int(bench.od[index].value) for index in (0x6040, 0x6060, 0x607A, 0x60FF)]
    assert values == [SHUTDOWN, 8, -256, 500]


def test_nothing_is_written_where_one_value_is_wrong(bench: Bench, service: ModbusService) -> None:
    before = [bench.od[index].value for index in (0x6040, 0x6060, 0x607A)]
    assert service.answer(1, write(CONTROLWORD, SHUTDOWN, 300, 0, 1)) == refused(16, VALUE)  # mode beyond INTEGER8
    assert [bench.od[index].value for index in (0x6040, 0x6060, 0x607A)] == before


@pytest.mark.parametrize("command", [0x6040, 0x6060])
def test_a_command_acts_after_the_set_point_of_the_same_request(bench: Bench, service: ModbusService, command: int) -> None:
    """The controlword is one; which objects are is the drive's to say (`Variable.is_command`), here as in an RPDO."""
    written: list[int] = []
    bench.od[0x6040].is_command = False
    bench.od[command].is_command = True
    for index in (command, 0x607A):
        earlier = bench.od[index].on_write

        def note(value: object, index: int = index, earlier: object = earlier) -> None:
            written.append(index)
            if callable(earlier):
                earlier(value)

        bench.od[index].on_write = note
    service.answer(1, write(CONTROLWORD, SHUTDOWN, 8, 0, 1))
    assert written == [0x607A, command]


def test_read_write_writes_first(bench: Bench, service: ModbusService) -> None:
    head = struct.pack(">BHHHHB", 23, STATUSWORD, 1, CONTROLWORD, 1, 2)
    answer = service.answer(1, head + struct.pack(">H", SHUTDOWN))
    assert answer == bytes.fromhex("17 02") + int(bench.od[0x6041].read()).to_bytes(2, "big")
    assert bench.state() == 0x21
    unmapped = struct.pack(">BHHHHB", 23, 0x4000, 1, CONTROLWORD, 1, 2)
    assert service.answer(1, unmapped + struct.pack(">H", 0)) == refused(23, ADDRESS)
    assert bench.state() == 0x21


@pytest.mark.parametrize(
    ("pdu", "code"),
    [
        pytest.param(read(3, 0x4000, 1), ADDRESS, id="unmapped"),
        pytest.param(read(3, 0x0009, 100), ADDRESS, id="reaches into unmapped"),
        pytest.param(read(4, 0xFFFF, 2), ADDRESS, id="beyond the last address"),
        pytest.param(write_one(STATUSWORD, 0), ADDRESS, id="read-only"),
        pytest.param(write(STATUSWORD, 0), ADDRESS, id="read-only by 16"),
        pytest.param(read(3, 0, 0), VALUE, id="no register"),
        pytest.param(read(3, 0, 126), VALUE, id="too many registers"),
        pytest.param(read(3, 0, 1) + b"\0", VALUE, id="a byte too many"),
        pytest.param(b"\x03", VALUE, id="no fields"),
        pytest.param(b"\x06\x00", VALUE, id="half an address"),
        pytest.param(write(0, *[0] * 124), VALUE, id="too many written"),
        pytest.param(bytes.fromhex("10 0000 0001 04 0000"), VALUE, id="byte count is not twice the count"),
        pytest.param(bytes.fromhex("10 0000 0002 04 0000"), VALUE, id="bytes missing"),
        pytest.param(bytes.fromhex("17 0100 0000 0000 0001 02 0000"), VALUE, id="23 reads nothing"),
        pytest.param(write_one(MODE, 5), VALUE, id="a mode that the drive has not"),
        pytest.param(b"\x01\x00\x00\x00\x01", FUNCTION, id="coils"),
        pytest.param(b"\x55", FUNCTION, id="unknown function"),
        pytest.param(b"\x2b\x0e\x01\x00", FUNCTION, id="another MEI type"),
    ],
)
def test_refusals(service: ModbusService, pdu: bytes, code: int) -> None:
    assert service.answer(1, pdu) == refused(pdu[0], code)


def test_the_unit_identifier_is_the_node_id() -> None:
    bench = Bench(machine="scara")
    service = bench.service()
    for drive in bench.virtual.drives:
        drive.dictionary[0x6081].write(drive.device.nmt.node_id * 1000)
    for unit in (1, 2, 3):
        expected = struct.pack(">BBI", 3, 4, unit * 1000)
        assert service.answer(unit, read(3, PROFILE_VELOCITY, 2)) == expected
    for unit in (0, 4, 255):
        assert service.answer(unit, read(3, PROFILE_VELOCITY, 2)) == refused(3, NO_TARGET)


@pytest.mark.parametrize("unit", [0, 255])
def test_a_machine_with_one_drive_needs_no_unit_identifier(service: ModbusService, unit: int) -> None:
    assert service.answer(unit, read(3, STATUSWORD, 1))[:2] == b"\x03\x02"


def test_on_a_line_other_units_are_not_answered_and_a_broadcast_writes_to_all() -> None:
    bench = Bench(machine="scara")
    service = bench.service()
    assert service.answer_on_line(9, read(3, STATUSWORD, 1)) is None
    assert service.answer_on_line(0, write(PROFILE_VELOCITY, 0, 77)) is None
    assert [drive.dictionary[0x6081].value for drive in bench.virtual.drives] == [77, 77, 77]
    assert service.answer_on_line(0, read(3, STATUSWORD, 1)) is None


def test_a_move_by_registers_alone(bench: Bench, service: ModbusService) -> None:
    """Profile velocity: mode, ramps and the state machine, all by function 16."""
    for address, value in ((0x0202, 2_000_000), (0x0204, 2_000_000), (PROFILE_VELOCITY, 400_000)):
        service.answer(1, write(address, value >> 16, value & 0xFFFF))
    service.answer(1, write_one(MODE, 3))
    for command in (SHUTDOWN, SWITCH_ON, ENABLE):
        service.answer(1, write_one(CONTROLWORD, command))
        bench.sync(20)
    assert bench.state() == 0x27
    begin = bench.od[0x6064].read()
    service.answer(1, write(TARGET_VELOCITY, 400_000 >> 16, 400_000 & 0xFFFF))
    bench.sync(1000)
    assert struct.unpack(">i", service.answer(1, read(4, 0x0104, 2))[2:])[0] == pytest.approx(400_000, rel=0.1)
    assert int(bench.od[0x6064].read()) > int(begin)


def test_a_drive_with_objects_of_its_own_leaves_addresses_empty() -> None:
    own = ObjectDictionary.from_profile(load_profile("servoone"), 1)
    registers = Registers(load_modbus_map("cia402-full"), own, lambda *_: None)
    assert registers.read(STATUSWORD, 1) == [0]
    assert (0x6062, 0) not in own
    with pytest.raises(ModbusException, match="02h"):
        registers.read(0x010C, 1)
