"""CiA 402-2, clause 'Homing mode': start, end, interruption the zero that it leaves (methods: test_homing_methods.py)."""

from __future__ import annotations

import can
import pytest
from drive_bench import ENABLE, HOMING, PROFILE_VELOCITY, SHUTDOWN, START, DriveBench

from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.drive.state_machine import State

REACHED, ATTAINED, FAILED, RUNNING = 1 << 10, 1 << 12, 1 << 13, 0
"""Bits of the statusword that the modes own."""

FAST, SLOW = 60.0, 6.0

UP = 500.0


def mode_bits(bench: DriveBench) -> int:
    return int(bench.read(0x6041)) & (REACHED | ATTAINED | FAILED)


def homing_bench(method: int, offset: int = 12_345, machine: str = "stage", axis: str = "slide") -> DriveBench:
    bench = DriveBench(machine, axis)
    bench.write(0x6098, method)
    bench.write(0x6099, bench.units(FAST), 1)
    bench.write(0x6099, bench.units(SLOW), 2)
    bench.write(0x609A, bench.units(2000.0))
    bench.write(0x607C, offset)
    bench.enable(HOMING)
    assert mode_bits(bench) == REACHED  # not started
    return bench


def home(bench: DriveBench, limit: int = 12_000) -> set[int]:
    """Start and run to the end of homing; the status bits on the way."""
    bench.write(0x6040, START)
    seen: set[int] = set()
    for _ in range(limit):
        bench.sync()
        bits = mode_bits(bench)
        if bits == REACHED | ATTAINED or bits & FAILED:
            return seen
        seen.add(bits)
    raise AssertionError(f"homing did not end; status bits {seen}")


@pytest.mark.parametrize(("machine", "axis"), [("stage", "slide"), ("scara", "lift"), ("scara", "stretch")])
@pytest.mark.parametrize("method", [17, 18])
def test_home_is_the_edge_of_the_switch(method: int, machine: str, axis: str) -> None:
    """Within the way of one servo period at the slow speed, and an increment; the zero is 607Ch beyond it (CiA 402-2)."""
    bench = homing_bench(method, machine=machine, axis=axis)
    assert home(bench) <= {RUNNING, ATTAINED}
    bench.sync(300)
    switches = bench.configuration.limit_switches
    edge = switches.negative if method == 17 else switches.positive
    away = bench.motor - edge * bench.configuration.gear_ratio
    told = (bench.read(0x6064) + 12_345) / bench.units(1.0)
    assert abs(told - away) < SLOW * SERVO_PERIOD + 2.0 / bench.units(1.0)
    assert away > 0.0 if method == 17 else away < 0.0
    assert int(bench.read(0x60FD)) & 3 == 0
    assert bench.state is State.OPERATION_ENABLED


def test_homing_that_begins_on_the_switch() -> None:
    bench = homing_bench(17)
    home(bench)
    bench.command(ENABLE)
    bench.write(0x6060, PROFILE_VELOCITY)
    bench.write(0x6083, bench.units(500.0))
    bench.write(0x60FF, -bench.units(5.0))
    bench.sync(2000)
    assert int(bench.read(0x60FD)) & 3 == 1
    assert bench.emergencies() == [0x5442]
    bench.command(0x80, SHUTDOWN)
    bench.enable(HOMING)
    bench.sync(50)
    home(bench)
    bench.sync(200)
    away = bench.motor - bench.configuration.limit_switches.negative * bench.configuration.gear_ratio
    assert (bench.read(0x6064) + 12_345) / bench.units(1.0) == pytest.approx(away, abs=1.5 * SLOW * SERVO_PERIOD)


@pytest.mark.parametrize("method", [35, 37])
@pytest.mark.parametrize("polarity", [0x00, 0x80])
def test_home_is_here(method: int, polarity: int) -> None:
    bench = homing_bench(method)
    bench.write(0x607E, polarity)
    start = bench.joint
    home(bench, limit=3)
    assert bench.read(0x6064) == pytest.approx(-12_345, abs=1)
    assert bench.joint == pytest.approx(start, abs=1e-9)


def test_a_homing_method_that_is_not_there() -> None:
    bench = homing_bench(15)
    home(bench, limit=3)
    assert mode_bits(bench) == FAILED | REACHED  # error, and the axis stands


def test_homing_is_interrupted_by_bit_4() -> None:
    bench = homing_bench(17)
    bench.command(START)
    bench.sync(200)
    assert mode_bits(bench) == RUNNING
    bench.command(ENABLE)
    bench.sync(200)
    assert mode_bits(bench) == REACHED
    assert abs(bench.joint_velocity) < 1e-6


def test_homing_takes_over_a_moving_axis_by_its_ramp() -> None:
    bench = DriveBench()
    bench.write(0x6083, bench.units(UP))
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, bench.units(50.0))
    bench.sync(300)
    bench.write(0x609A, bench.units(UP))
    speed = bench.joint_velocity * bench.configuration.gear_ratio
    bench.write(0x6060, HOMING)
    way = -bench.motor
    bench.sync(200)
    way += bench.motor
    assert way == pytest.approx(speed**2 / (2.0 * UP), rel=0.2)
    assert abs(bench.joint_velocity) < 1e-4


@pytest.mark.parametrize("by", ["mode", "disabling", "quick stop", "fault"])
def test_homing_attained_stays_until_the_reference_is_lost(by: str) -> None:
    """CiA 402-2, 'Homing mode', bit 12: the axis is homed, whatever has been done with it since."""
    bench = homing_bench(35)
    home(bench)
    assert mode_bits(bench) == ATTAINED | REACHED
    bench.command(ENABLE)
    if by == "mode":
        bench.write(0x6060, PROFILE_VELOCITY)
        bench.sync(5)
        bench.write(0x6060, HOMING)
    elif by == "disabling":
        bench.command(SHUTDOWN, 0, SHUTDOWN, 7, ENABLE)
    elif by == "quick stop":
        bench.command(2)
        bench.sync(100)
        bench.command(0, SHUTDOWN, 7, ENABLE)
    else:
        bench.drive.fault(0x7500)
        bench.sync(100)
        bench.command(0x80, 0, SHUTDOWN, 7, ENABLE)
    bench.sync(5)
    assert bench.state is State.OPERATION_ENABLED
    assert mode_bits(bench) == ATTAINED | REACHED


def test_a_new_homing_takes_it_back_at_once() -> None:
    bench = homing_bench(17)
    home(bench)
    bench.command(ENABLE)
    assert mode_bits(bench) == ATTAINED | REACHED
    bench.write(0x6040, START)
    assert mode_bits(bench) == RUNNING
    bench.sync(2)
    assert mode_bits(bench) == RUNNING
    bench.command(ENABLE)
    bench.sync(100)
    assert mode_bits(bench) == REACHED  # interrupted, and the zero is no longer known


@pytest.mark.parametrize("by", ["encoder", "reset"])
def test_a_reference_that_is_lost_is_told(by: str) -> None:
    bench = homing_bench(35)
    home(bench)
    if by == "encoder":
        bench.drive.hardware.encoder_alive = False
        bench.sync(100)
        bench.drive.hardware.encoder_alive = True
        bench.command(0, 0x80)
    else:
        bench.virtual.receive(can.Message(arbitration_id=0, data=b"\x81\x01", is_extended_id=False))
        bench.write(0x6060, HOMING)
    bench.command(0, SHUTDOWN, 7, ENABLE)
    bench.sync(5)
    assert bench.state is State.OPERATION_ENABLED
    assert mode_bits(bench) == REACHED
