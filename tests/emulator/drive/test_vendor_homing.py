"""Where vendors differ in homing: a drive that latches the start runs on when bit 4 is cleared, and tells that it is homed."""

from __future__ import annotations

import pytest
from drive_bench import ENABLE, HOMING, START, DriveBench

HOMING_STATUS = 0x2014
ATTAINED, ERROR = 1 << 12, 1 << 13


def homed_by_a_pulse(bench: DriveBench, longest: int = 20_000) -> int:
    """Pulse bit 4 for one cycle and wait for the end; bits 12 and 13 of the statusword."""
    bench.enable(HOMING)
    bench.command(START, ENABLE)
    for _ in range(longest):
        bench.sync()
        bits = int(bench.read(0x6041)) & (ATTAINED | ERROR)
        if bits:
            return bits
    return 0


def test_dryve_d1_homes_by_a_pulse() -> None:
    """As dryve-d1 starts it: 001Fh, then 000Fh; 6098h is read-only and 17 at power-on."""
    bench = DriveBench(profile="dryve_d1")
    assert bench.read(HOMING_STATUS) == 0
    assert homed_by_a_pulse(bench) == ATTAINED
    assert bench.read(HOMING_STATUS) == 1
    assert bench.motor == pytest.approx(bench.configuration.limit_switches.negative * bench.configuration.gear_ratio, abs=0.1)
    bench.write(0x6060, 3)
    bench.sync(5)
    assert bench.read(HOMING_STATUS) == 1


def test_a_pulse_within_one_cycle_is_seen() -> None:
    """Two SDO writes come faster than a cycle."""
    bench = DriveBench(profile="dryve_d1")
    bench.enable(HOMING)
    bench.write(0x6040, START)
    bench.command(ENABLE)
    assert int(bench.read(0x6041)) & (1 << 10) == 0
    bench.sync(50)
    assert bench.joint_velocity < 0.0


def test_a_new_homing_is_not_homed_until_it_ends() -> None:
    bench = DriveBench(profile="dryve_d1")
    homed_by_a_pulse(bench)
    bench.command(START, ENABLE)
    assert bench.read(HOMING_STATUS) == 0


def test_other_drives_stop_when_bit_4_is_cleared() -> None:
    bench = DriveBench(profile="cia402-full")
    bench.write(0x6098, 17)
    bench.write(0x6099, bench.units(6.0), 1)
    bench.write(0x6099, bench.units(0.6), 2)
    assert homed_by_a_pulse(bench, 3000) == 0


def test_dryve_d1_moves_with_the_commissioned_gains() -> None:
    """It has no objects for its loops; they are closed all the same."""
    bench = DriveBench(profile="dryve_d1")
    reference = DriveBench(profile="cia402-full")
    for field in ("position_gain", "velocity_gain", "integral_rate", "velocity_feedforward", "velocity_filter"):
        assert bench.drive.axis.servo.parameters[field] == pytest.approx(reference.drive.axis.servo.parameters[field])


def test_a_pulse_before_the_first_cycle_is_seen() -> None:
    """Operation is enabled and bit 4 pulsed within a cycle, as by SDO at a SYNC of 10 ms."""
    bench = DriveBench(profile="dryve_d1")
    bench.write(0x6060, HOMING)
    bench.command(0x06, 0x07)
    for controlword in (ENABLE, START, ENABLE):
        bench.write(0x6040, controlword)
    bench.sync(50)
    assert bench.joint_velocity < 0.0
