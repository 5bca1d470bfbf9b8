"""CiA 402-2, clause 'Profile velocity mode': ramps with and without jerk, limits, status bits; against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from drive_bench import CYCLE, DISABLE_VOLTAGE, ENABLE, PROFILE_VELOCITY, SHUTDOWN, SWITCH_ON, DriveBench

from drivetwin.emulator.canopen import AbortCode, SdoAbort
from drivetwin.emulator.drive.servo import SERVO_PERIOD

UP, DOWN, SPEED = 500.0, 250.0, 50.0
"""6083h, 6084h [rad/s²] and 60FFh [rad/s]."""

REACHED, STANDING = 1 << 10, 1 << 12


def velocity_bench() -> DriveBench:
    bench = DriveBench()
    bench.write(0x6083, bench.units(UP))
    bench.write(0x6084, bench.units(DOWN))
    bench.enable(PROFILE_VELOCITY)
    return bench


def closed_form(start: float, target: float, time: np.ndarray) -> np.ndarray:
    if start * target < 0.0:
        to_zero = abs(start) / DOWN
        before = start - np.sign(start) * DOWN * time
        after = np.sign(target) * np.minimum(UP * (time - to_zero), abs(target))
        return np.asarray(np.where(time < to_zero, before, after))
    rate = UP if abs(target) > abs(start) else DOWN
    change = np.minimum(rate * time, abs(target - start))
    return np.asarray(start + np.sign(target - start) * change)


def test_velocity_ramps_as_given() -> None:
    """Up by 6083h, down by 6084h; a reversal slows down to zero by 6084h and speeds up by 6083h."""
    bench = velocity_bench()
    unit = bench.units(1.0)
    cycles = np.arange(1, 301)
    for start, target in ((0.0, SPEED), (SPEED, 20.0), (20.0, -30.0), (-30.0, 0.0)):
        bench.write(0x60FF, bench.units(target))
        demand = bench.record(300, 0x606B)[:, 0] / unit
        expected = closed_form(start, target, cycles * CYCLE)
        assert np.abs(demand - expected).max() < 1.5 * UP * SERVO_PERIOD
        steady = bench.record(50, 0x606C)[:, 0].mean() / unit
        assert steady == pytest.approx(target, rel=0.15, abs=0.05)


def test_speed_is_limited_by_607f() -> None:
    bench = velocity_bench()
    bench.write(0x607F, bench.units(12.0))
    for sign in (1, -1):
        bench.write(0x60FF, sign * bench.units(SPEED))
        bench.sync(300)
        assert bench.read(0x606B) == pytest.approx(sign * bench.units(12.0), abs=1)


def test_an_acceleration_of_zero_is_no_limit() -> None:
    bench = DriveBench()
    for ramp in (0x6083, 0x6084):
        bench.write(ramp, 0)
    bench.enable(PROFILE_VELOCITY)
    for target in (SPEED, -SPEED, 0.0):
        bench.write(0x60FF, bench.units(target))
        bench.sync()
        assert bench.read(0x606B) == bench.units(target)


def test_velocity_status_bits() -> None:
    """Bit 10 target reached, bit 12 speed is 0."""
    bench = velocity_bench()
    bench.drive.axis.servo.parameters["integral_rate"] = 100.0
    bench.sync(2)
    assert int(bench.read(0x6041)) & (REACHED | STANDING) == REACHED | STANDING
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(50)
    assert int(bench.read(0x6041)) & (REACHED | STANDING) == 0
    bench.sync(300)
    assert int(bench.read(0x6041)) & (REACHED | STANDING) == REACHED


def test_enabling_a_coasting_axis_starts_from_its_speed() -> None:
    bench = velocity_bench()
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(300)
    bench.command(DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON)
    speed = bench.joint_velocity * bench.configuration.gear_ratio
    bench.command(ENABLE)
    assert bench.read(0x606B) / bench.units(1.0) == pytest.approx(speed, rel=0.1)


JERK = 10_000.0
"""60A4h:01 [rad/s³]."""


def smooth_bench() -> DriveBench:
    bench = velocity_bench()
    bench.write(0x6086, 3)
    bench.write(0x60A4, bench.units(JERK), 1)
    return bench


def demands(bench: DriveBench, cycles: int) -> np.ndarray:
    """Demanded motor speed [rad/s] of every servo period."""
    rows = []
    for _ in range(cycles):
        bench.sync()
        rows.append(bench.drive.axis.servo.demand[:, 1].copy())
    return np.concatenate(rows)


def test_jerk_limited_ramps() -> None:
    """6086h = 3: to 50 rad/s in v/a + a/j = 150 ms, back in v/d + d/j = 225 ms; acceleration and jerk within bounds."""
    bench = smooth_bench()
    for target, rate in ((SPEED, UP), (0.0, DOWN)):
        before = float(bench.drive.axis.servo.demand[-1, 1])
        bench.write(0x60FF, bench.units(target))
        speeds = demands(bench, 300)
        arrived = int(np.flatnonzero(np.abs(speeds - target) > 1e-4)[-1] + 2) * SERVO_PERIOD
        assert arrived == pytest.approx(abs(target - before) / rate + rate / JERK, abs=2 * SERVO_PERIOD)
        acceleration = np.diff(speeds) / SERVO_PERIOD
        assert np.abs(acceleration).max() == pytest.approx(rate, rel=1e-3)
        assert np.abs(np.diff(acceleration)).max() / SERVO_PERIOD <= JERK * 1.001


def test_a_target_that_changes_on_the_way_keeps_the_jerk() -> None:
    bench = smooth_bench()
    pieces = []
    for target in (50.0, 20.0, -30.0, -10.0):
        bench.write(0x60FF, bench.units(target))
        pieces.append(demands(bench, 60))
    speeds = np.concatenate(pieces)
    jerk = np.diff(speeds, 2) / SERVO_PERIOD**2
    assert np.abs(jerk).max() <= JERK * 1.001
    assert speeds.max() < 50.0


def test_at_a_software_limit_the_linear_ramp_has_to_do() -> None:
    bench = smooth_bench()
    start = bench.read(0x6064)
    bench.write(0x607D, int(start) - bench.units(1.0), 1)
    bench.write(0x607D, int(start) + bench.units(20.0), 2)
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(3000)
    assert abs(bench.joint_velocity) < 1e-3
    assert (bench.read(0x6064) - start) / bench.units(1.0) == pytest.approx(20.0, abs=0.7)


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
@pytest.mark.parametrize("kind", [1, 2])
def test_ramps_that_the_drive_does_not_have_are_refused(profile: str, kind: int) -> None:
    """sin² and jerk-free ramp, with 0609 0030h."""
    bench = DriveBench(profile=profile)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x6086, kind)
    assert refusal.value.code == AbortCode.INVALID_VALUE
    for one in (0, 3):
        bench.write(0x6086, one)


@pytest.mark.parametrize("jerks", [0, 2, 4, 255])
def test_one_jerk_is_used(jerks: int) -> None:
    """60A3h: 60A4h:01 is the jerk of all four corners."""
    bench = DriveBench()
    assert bench.read(0x60A3) == 1
    bench.write(0x60A3, 1)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x60A3, jerks)
    assert refusal.value.code == AbortCode.INVALID_VALUE
