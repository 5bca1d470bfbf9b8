"""Faults that come from the plant: each with its EMCY, 603Fh and 1001h, its reaction, and a reset only without its cause."""

from __future__ import annotations

from collections.abc import Callable
from math import log

import pytest
from drive_bench import CYCLE, ENABLE, FAULT_RESET, PROFILE_VELOCITY, SHUTDOWN, SWITCH_ON, DriveBench

from drivetwin.emulator.drive.faults import FAULTS
from drivetwin.emulator.drive.hardware import Hardware, LimitSwitches
from drivetwin.emulator.drive.servo import VELOCITY, Loop
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.drive.stops import STANDSTILL
from drivetwin.emulator.machine import load_machine

TORQUE = 4
SPEED, QUICK_RAMP = 20.0, 400.0


def moving(speed: float = SPEED, profile: str = "cia402-full") -> DriveBench:
    bench = DriveBench(profile=profile)
    for index, value in ((0x6083, 500.0), (0x6084, 500.0), (0x6085, QUICK_RAMP), (0x60FF, speed)):
        bench.write(index, bench.units(value))
    bench.enable(PROFILE_VELOCITY)
    bench.sync(200)
    return bench


def short_circuit(hardware: Hardware) -> None:
    hardware.current_scale = 1e6


def whole_windings(hardware: Hardware) -> None:
    hardware.current_scale = 1.0


def safe_torque_off(hardware: Hardware) -> None:
    hardware.sto = True


def torque_allowed(hardware: Hardware) -> None:
    hardware.sto = False


def unplugged(hardware: Hardware) -> None:
    hardware.encoder_alive = False


def plugged(hardware: Hardware) -> None:
    hardware.encoder_alive = True


def voltage(volts: float) -> Callable[[Hardware], None]:
    def act(hardware: Hardware) -> None:
        hardware.dc_link_voltage = volts

    return act


DISTURBANCES = [
    (0x2310, 0x03, short_circuit, whole_windings),
    (0x3220, 0x05, voltage(150.0), voltage(325.0)),
    (0x3210, 0x05, voltage(420.0), voltage(325.0)),
    (0x5441, 0x21, safe_torque_off, torque_allowed),
    (0x7305, 0x21, unplugged, plugged),
]


@pytest.mark.parametrize(("code", "register", "disturb", "mend"), DISTURBANCES)
def test_hardware_faults_switch_off_at_once(
    code: int, register: int, disturb: Callable[[Hardware], None], mend: Callable[[Hardware], None]
) -> None:
    """No torque can be relied on: the axis coasts whatever 605Eh says; reset is refused while the cause lasts."""
    bench = moving()
    disturb(bench.drive.hardware)
    bench.sync(2)
    assert bench.emergencies() == [code]
    assert (bench.read(0x603F), bench.read(0x1001)) == (code, register)
    assert (bench.state, bench.drive.axis.servo.loop) == (State.FAULT, Loop.OFF)
    bench.sync(50)
    bench.command(FAULT_RESET, 0)
    persists = code != 0x2310  # its cause is gone with the current
    assert (bench.state is State.FAULT) == persists
    mend(bench.drive.hardware)
    bench.sync()
    bench.command(FAULT_RESET)
    assert bench.state is State.SWITCH_ON_DISABLED
    assert bench.emergencies() == [code, 0]
    assert (bench.read(0x603F), bench.read(0x1001)) == (0, 0)


@pytest.mark.parametrize(("code", "disturb"), [(row[0], row[2]) for row in DISTURBANCES[1:]])
def test_no_fault_while_nothing_is_switched_on(code: int, disturb: Callable[[Hardware], None]) -> None:
    bench = DriveBench()
    disturb(bench.drive.hardware)
    bench.command(SHUTDOWN)
    bench.sync(5)
    assert bench.emergencies() == []
    bench.command(SWITCH_ON)
    bench.sync()
    assert bench.emergencies() == [code]


def test_voltage_enabled_bit_follows_the_dc_link() -> None:
    """6041h bit 4 and 6079h."""
    bench = DriveBench()
    assert int(bench.read(0x6041)) & 1 << 4
    assert bench.read(0x6079) == 325_000
    bench.drive.hardware.dc_link_voltage = 12.5
    assert not int(bench.read(0x6041)) & 1 << 4
    assert bench.read(0x6079) == 12_500


def test_overload_by_the_thermal_model() -> None:
    """I2t: at n times rated torque after tau ln(n² / (n² - 1)); a ramp down; reset once it has cooled to 0.9."""
    machine = load_machine("stage")
    slide = machine.axes["slide"]
    cold = slide.model_copy(update={"motor": slide.motor.model_copy(update={"thermal_time_constant": 0.2})})
    bench = DriveBench(machine.model_copy(update={"axes": {"slide": cold}}), effects=())
    bench.write(0x6072, 3000)
    bench.write(0x6087, 0)
    bench.enable(TORQUE)
    heat = bench.drive.axis.servo.state
    elapsed = 0
    while bench.state is State.OPERATION_ENABLED:
        bench.write(0x6071, 2000 if (elapsed // 10) % 2 else -2000)  # to and fro, so that it stays on the way
        bench.sync()
        elapsed += 1
    assert elapsed * CYCLE == pytest.approx(0.2 * log(4.0 / 3.0), rel=0.25)  # the current lags at each reversal
    assert bench.emergencies() == [0x2350]
    assert (bench.read(0x603F), bench.read(0x1001)) == (0x2350, 0x03)
    bench.sync(3)
    bench.command(FAULT_RESET, 0)
    refused = bench.state
    assert refused in (State.FAULT, State.FAULT_REACTION_ACTIVE)
    while float(heat["heat"]) > 0.9:
        bench.sync()
    bench.sync(150)  # the axis stands
    bench.command(FAULT_RESET)
    assert bench.state is State.SWITCH_ON_DISABLED


def test_rated_torque_is_no_overload() -> None:
    bench = DriveBench(effects=())
    bench.enable(TORQUE)
    state = bench.drive.axis.servo.state
    state["heat"] = 0.999
    for cycle in range(400):
        bench.write(0x6071, 990 if (cycle // 10) % 2 else -990)
        bench.sync()
    assert bench.emergencies() == []


def test_overspeed() -> None:
    machine = load_machine("stage")
    slide = machine.axes["slide"]
    weak = slide.model_copy(update={"motor": slide.motor.model_copy(update={"max_speed": 15.0})})
    bench = DriveBench(machine.model_copy(update={"axes": {"slide": weak}}))
    for index, value in ((0x6083, 500.0), (0x6085, QUICK_RAMP), (0x60FF, 30.0)):
        bench.write(index, bench.units(value))
    bench.enable(PROFILE_VELOCITY)
    bench.sync(300)
    assert bench.emergencies() == [0x8400]
    assert (bench.read(0x603F), bench.read(0x1001), bench.state) == (0x8400, 0x21, State.FAULT)
    bench.command(FAULT_RESET)
    assert bench.state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize(("sign", "code"), [(-1.0, 0x5442), (1.0, 0x5443)])
def test_limit_switch(sign: float, code: int) -> None:
    """A ramp down, and after a reset only the way back is open."""
    bench = moving(sign * SPEED)
    here = bench.motor
    bench.drive.hardware.switches = LimitSwitches(here + 1.0, 1e9) if sign < 0.0 else LimitSwitches(-1e9, here - 1.0)
    bench.sync(2)
    assert bench.emergencies() == [code]
    assert (bench.read(0x603F), bench.read(0x1001), bench.state) == (code, 0x21, State.FAULT_REACTION_ACTIVE)
    bench.sync(200)
    stopped = bench.state
    assert stopped is State.FAULT
    bench.write(0x60FF, -sign * bench.units(SPEED))
    bench.command(FAULT_RESET, SHUTDOWN, SWITCH_ON, ENABLE)
    bench.sync(20)
    assert bench.state is State.OPERATION_ENABLED
    bench.write(0x60FF, sign * bench.units(SPEED))
    bench.drive.hardware.switches = LimitSwitches(bench.motor + 9.0, 1e9) if sign < 0.0 else LimitSwitches(-1e9, -1e9)
    bench.sync(200)
    assert bench.state is not State.OPERATION_ENABLED


def test_fault_reaction_ramps_down_by_its_option() -> None:
    """605Eh = 2, from the speed that the axis has, by 6085h; 'fault reaction active' until the axis stands."""
    bench = moving()
    speed = bench.joint_velocity * bench.configuration.gear_ratio
    bench.drive.hardware.switches = LimitSwitches(-1e9, -1e9)
    bench.sync()
    ramp = rest = 0
    while bench.state is not State.FAULT:
        assert bench.state is State.FAULT_REACTION_ACTIVE
        bench.sync()
        moves = bool(bench.drive.axis.servo.demand[-1, VELOCITY] != 0.0)
        ramp, rest = ramp + moves, rest + (not moves)
    assert ramp * CYCLE == pytest.approx(speed / QUICK_RAMP, abs=3 * CYCLE)
    assert 0 < rest * CYCLE < 0.2
    assert abs(bench.joint_velocity) * bench.configuration.gear_ratio < STANDSTILL


def test_a_coasting_fault_ends_the_ramp_of_another() -> None:
    bench = moving()
    bench.write(0x6085, bench.units(20.0))
    bench.drive.hardware.switches = LimitSwitches(-1e9, -1e9)
    bench.sync(5)
    bench.drive.hardware.sto = True
    bench.sync(2)
    assert bench.state is State.FAULT
    assert bench.emergencies() == [0x5443, 0x5441]
    assert bench.drive.axis.servo.loop is Loop.OFF


@pytest.mark.parametrize("option", [3, 4])
def test_stop_at_the_current_limit(option: int) -> None:
    """605Eh = 3, 4: all torque that 6072h allows; far quicker than the ramps."""
    bench = moving()
    bench.write(0x605E, option)
    bench.write(0x6085, bench.units(10.0))
    bench.drive.fault(0x8611)
    bench.sync(60)
    assert bench.state is State.FAULT
    assert abs(bench.joint_velocity) < 1e-3


@pytest.mark.parametrize("option", [3, 4, 7, 8])
def test_quick_stop_at_the_current_limit(option: int) -> None:
    bench = moving()
    bench.write(0x605A, option)
    bench.write(0x6040, 0x02)
    bench.sync(80)
    assert bench.state is (State.QUICK_STOP_ACTIVE if option > 4 else State.SWITCH_ON_DISABLED)
    assert abs(bench.joint_velocity) < 1e-3


@pytest.mark.parametrize("option", [3, 4])
def test_halt_at_the_current_limit(option: int) -> None:
    bench = moving()
    bench.write(0x605D, option)
    bench.write(0x6040, ENABLE | 0x100)
    bench.sync(60)
    assert bench.state is State.OPERATION_ENABLED
    assert int(bench.read(0x6041)) & 1 << 10
    assert abs(bench.joint_velocity) < 1e-3


def test_codes_are_those_of_the_list() -> None:
    """Groups of the DS402 list: 2xxxh current, 3xxxh voltage, 5xxxh hardware, 7xxxh sensors, 8xxxh monitoring."""
    assert {fault.code for fault in FAULTS} == {
        *(0x2310, 0x2350, 0x3210, 0x3220, 0x5441, 0x5442, 0x5443, 0x7305, 0x8400, 0x8611),
    }
    for fault in FAULTS:
        assert fault.register & 1
        assert bool(fault.register & 0x02) == (fault.code >> 12 == 2)
        assert bool(fault.register & 0x04) == (fault.code >> 12 == 3)
