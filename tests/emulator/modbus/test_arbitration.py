"""One drive, two masters: who enabled it has control until its power stage is off."""

import struct

import pytest
from modbus_bench import (
    CONTROLWORD,
    DISABLE_VOLTAGE,
    ENABLE,
    MODE,
    PROFILE_VELOCITY,
    QUICK_STOP,
    SHUTDOWN,
    STATUSWORD,
    SWITCH_ON,
    TARGET_VELOCITY,
    Bench,
)

from drivetwin.emulator.modbus.arbitration import Master

LOCAL_CONTROL = 0x08000021
BUSY = 6
OPERATION_ENABLED, SWITCH_ON_DISABLED, QUICK_STOP_ACTIVE = 0x27, 0x40, 0x07


class TwoMasters(Bench):
    """Each master writes one object: 0 when it was taken."""

    def __init__(self, profile: str = "cia402-full") -> None:
        super().__init__(profile)
        self._service = self.service()
        self.arbitration = self._service.units[0].arbitration

    def modbus(self, address: int, *words: int) -> int:
        """Function 16: the exception code."""
        answer = self._service.answer(1, struct.pack(f">BHHB{len(words)}H", 16, address, len(words), 2 * len(words), *words))
        return answer[1] if answer[0] & 0x80 else 0

    def gateway(self, index: int, value: int, size: int) -> int:
        """Function 43: the abort code."""
        head = struct.pack(">BBBBBHBHH", 0x2B, 0x0D, 1, 0, 0, index, 0, 0, size)
        answer = self._service.answer(1, head + value.to_bytes(size, "little"))
        return int.from_bytes(answer[6:10], "big") if answer[0] & 0x80 else 0

    def read(self, address: int) -> int:
        answer = self._service.answer(1, struct.pack(">BHH", 3, address, 1))
        assert answer[0] == 3
        return int.from_bytes(answer[2:], "big")

    def canopen(self, index: int, value: int, size: int = 2) -> int:
        """SDO: the abort code."""
        return self.sdo_write(index, 0, value, size)

    def enable_by_modbus(self) -> None:
        assert self.modbus(MODE, 3) == 0
        for command in (SHUTDOWN, SWITCH_ON, ENABLE):
            assert self.modbus(CONTROLWORD, command) == 0
            self.sync(20)
        assert self.state() == OPERATION_ENABLED

    def enable_by_canopen(self) -> None:
        assert self.canopen(0x6060, 3, 1) == 0
        for command in (SHUTDOWN, SWITCH_ON, ENABLE):
            assert self.canopen(0x6040, command) == 0
            self.sync(20)
        assert self.state() == OPERATION_ENABLED


@pytest.fixture
def drive() -> TwoMasters:
    return TwoMasters()


def test_while_the_power_stage_is_off_both_may_write(drive: TwoMasters) -> None:
    assert drive.modbus(CONTROLWORD, SHUTDOWN) == 0
    assert drive.canopen(0x6040, SWITCH_ON) == 0
    assert drive.canopen(0x60FF, 5, 4) == 0
    assert drive.modbus(TARGET_VELOCITY, 0, 6) == 0
    assert drive.arbitration.in_control is None


def test_canopen_in_control_refuses_modbus(drive: TwoMasters) -> None:
    drive.enable_by_canopen()
    assert drive.arbitration.in_control is Master.CANOPEN
    assert drive.modbus(CONTROLWORD, ENABLE) == BUSY
    assert drive.modbus(CONTROLWORD, SHUTDOWN) == BUSY
    assert drive.modbus(MODE, 3) == BUSY
    assert drive.modbus(TARGET_VELOCITY, 0, 9) == BUSY
    assert drive.gateway(0x6040, ENABLE, 2) == LOCAL_CONTROL
    assert drive.gateway(0x60FF, 9, 4) == LOCAL_CONTROL
    assert drive.od[0x60FF].value == 0
    assert drive.read(STATUSWORD) & 0x6F == OPERATION_ENABLED
    assert drive.modbus(PROFILE_VELOCITY, 0, 9) == 0  # neither controlword, mode nor set-point
    assert drive.canopen(0x60FF, 1000, 4) == 0


def test_modbus_in_control_refuses_canopen(drive: TwoMasters) -> None:
    drive.enable_by_modbus()
    assert drive.arbitration.in_control is Master.MODBUS
    assert drive.canopen(0x6040, ENABLE) == LOCAL_CONTROL
    assert drive.canopen(0x6060, 3, 1) == LOCAL_CONTROL
    assert drive.canopen(0x60FF, 9, 4) == LOCAL_CONTROL
    assert drive.modbus(TARGET_VELOCITY, 0, 1000) == 0
    assert drive.gateway(0x60FF, 2000, 4) == 0


def test_a_pdo_of_the_other_master_is_without_effect(drive: TwoMasters) -> None:
    drive.can(0x000, b"\x01\x01")
    drive.can(0x200 + 1, SHUTDOWN.to_bytes(2, "little"))
    drive.sync()
    assert drive.state() == 0x21
    drive.enable_by_modbus()
    drive.sent.clear()
    for command in (SHUTDOWN, ENABLE | 0x100):
        drive.can(0x200 + 1, command.to_bytes(2, "little"))
        drive.sync(20)
    assert drive.state() == OPERATION_ENABLED
    assert drive.od[0x6040].value == ENABLE
    assert not [frame for frame in drive.sent if frame[0] == 0x81]  # and no EMCY


def test_nothing_of_a_request_is_written_where_a_part_is_refused(drive: TwoMasters) -> None:
    drive.enable_by_canopen()
    assert drive.modbus(CONTROLWORD, DISABLE_VOLTAGE, 3) == BUSY  # stopping alone would be allowed, the mode is not
    assert drive.state() == OPERATION_ENABLED


@pytest.mark.parametrize("owner", ["modbus", "canopen"])
def test_both_may_disable_voltage(drive: TwoMasters, owner: str) -> None:
    if owner == "modbus":
        drive.enable_by_modbus()
        assert drive.canopen(0x6040, DISABLE_VOLTAGE) == 0
    else:
        drive.enable_by_canopen()
        assert drive.modbus(CONTROLWORD, DISABLE_VOLTAGE) == 0
    drive.sync(100)
    assert drive.state() == SWITCH_ON_DISABLED
    assert drive.arbitration.in_control is None


@pytest.mark.parametrize("owner", ["modbus", "canopen"])
def test_both_may_quick_stop_and_control_stays_where_it_was(drive: TwoMasters, owner: str) -> None:
    drive.od[0x605A].write(6)  # stay in quick stop active
    if owner == "modbus":
        drive.enable_by_modbus()
        assert drive.canopen(0x6040, QUICK_STOP) == 0
        drive.sync(100)
        assert drive.canopen(0x6040, ENABLE) == LOCAL_CONTROL
        assert drive.state() == QUICK_STOP_ACTIVE
        assert drive.modbus(CONTROLWORD, ENABLE) == 0
    else:
        drive.enable_by_canopen()
        assert drive.modbus(CONTROLWORD, QUICK_STOP) == 0
        drive.sync(100)
        assert drive.modbus(CONTROLWORD, ENABLE) == BUSY
        assert drive.state() == QUICK_STOP_ACTIVE
        assert drive.canopen(0x6040, ENABLE) == 0
    drive.sync(20)
    assert drive.state() == OPERATION_ENABLED


def test_control_changes_hands_through_disabled(drive: TwoMasters) -> None:
    drive.enable_by_canopen()
    assert drive.canopen(0x6040, DISABLE_VOLTAGE) == 0
    drive.sync(100)
    drive.enable_by_modbus()
    assert drive.canopen(0x60FF, 9, 4) == LOCAL_CONTROL


def test_after_a_reset_nobody_has_control(drive: TwoMasters) -> None:
    drive.enable_by_modbus()
    drive.can(0x000, b"\x81\x01")
    drive.sync(5)
    assert drive.arbitration.in_control is None
    drive.enable_by_canopen()


def test_after_a_fault_whoever_enables_anew(drive: TwoMasters) -> None:
    drive.enable_by_modbus()
    drive.virtual.drives[0].fault(0x8611)
    drive.sync(2000)
    assert drive.state() == 0x08
    assert drive.canopen(0x6040, 0x80) == 0
    drive.sync(5)
    drive.enable_by_canopen()
    assert drive.modbus(TARGET_VELOCITY, 0, 9) == BUSY


def test_a_set_point_of_the_vendor_is_arbitrated_too() -> None:
    """2191h, the additive torque reference of a ServoOne (drive_profiles/servoone/modbus.yaml)."""
    drive = TwoMasters("servoone")
    drive.enable_by_canopen()
    assert drive.gateway(0x2191, 0, 4) == LOCAL_CONTROL
    assert drive.canopen(0x2191, 0, 4) == 0
