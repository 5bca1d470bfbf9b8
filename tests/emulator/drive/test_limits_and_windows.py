"""Limits (607Dh, 607Fh, 6080h, 60C5h, 6072h, 60E0h, 60E1h) with statusword bit 11, and windows (606Dh..6070h)."""

from __future__ import annotations

import struct

import can
import pytest
from drive_bench import CYCLIC, INTERPOLATED, PROFILE_VELOCITY, START, DriveBench

LIMIT, REACHED, STANDING = 1 << 11, 1 << 10, 1 << 12
SPEED = 20.0


def velocity_bench(profile: str = "cia402-full") -> DriveBench:
    bench = DriveBench(profile=profile)
    for index, value in ((0x6083, 500.0), (0x6084, 250.0)):
        bench.write(index, bench.units(value))
    bench.enable(PROFILE_VELOCITY)
    return bench


def limits(bench: DriveBench, low: float, high: float) -> None:
    """607Dh [rad]."""
    bench.write(0x607D, bench.units(low), 1)
    bench.write(0x607D, bench.units(high), 2)


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
@pytest.mark.parametrize("sign", [1, -1])
def test_velocity_stops_at_the_software_limit(profile: str, sign: int) -> None:
    """By 6084h, without overshoot of more than the loop's lag; the way back stays open."""
    bench = velocity_bench(profile)
    limits(bench, -6.0, 6.0)
    bench.write(0x60FF, sign * bench.units(SPEED))
    bench.sync(2000)
    assert sign * bench.read(0x6064) / bench.units(1.0) == pytest.approx(6.0, abs=0.7)
    assert int(bench.read(0x6041)) & LIMIT
    assert abs(bench.joint_velocity) < 1e-3
    assert not int(bench.read(0x6041)) & REACHED  # CiA 402-2, mode 3, bit 10: 60FFh is not reached
    bench.write(0x60FF, -sign * bench.units(SPEED))
    bench.sync(100)
    assert sign * bench.joint_velocity < 0.0
    assert not int(bench.read(0x6041)) & LIMIT


@pytest.mark.parametrize(("mode", "index", "sub"), [(CYCLIC, 0x607A, 0), (INTERPOLATED, 0x60C1, 1)])
def test_streamed_positions_are_clamped(mode: int, index: int, sub: int) -> None:
    bench = DriveBench("scara", "rotate")
    limits(bench, -1.0, 1.0)
    bench.enable(mode)
    bench.command(START)
    for target in (0.5, 1.0, 1.5, 2.0):
        bench.write(index, bench.units(target), sub)
        bench.sync(60)
        assert bench.read(0x6062) == pytest.approx(bench.units(min(target, 1.0)), abs=1)
        assert bool(int(bench.read(0x6041)) & LIMIT) == (target > 1.0)


def test_limits_that_are_none() -> None:
    """0 and 0, as a ServoOne has them until somebody sets them, and the ends of the type."""
    bench = velocity_bench("servoone")
    assert (bench.read(0x607D, 1), bench.read(0x607D, 2)) == (0, 0)
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(400)
    assert bench.read(0x606C) > bench.units(10.0)
    assert not int(bench.read(0x6041)) & LIMIT


@pytest.mark.parametrize("polarity", [0x00, 0xC0])
def test_software_limits_are_in_user_units(polarity: int) -> None:
    bench = velocity_bench()
    bench.write(0x607E, polarity)
    limits(bench, -2.0, 6.0)
    bench.write(0x60FF, -bench.units(SPEED))
    bench.sync(1500)
    assert bench.read(0x6064) / bench.units(1.0) == pytest.approx(-2.0, abs=0.7)


@pytest.mark.parametrize(("index", "value", "expected"), [(0x607F, 8.0, 8.0), (0x6080, None, 12.566370614)])
def test_speed_limits(index: int, value: float | None, expected: float) -> None:
    bench = velocity_bench()
    bench.write(index, 120 if value is None else bench.units(value))
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(300)
    assert bench.read(0x606B) == pytest.approx(bench.units(expected), abs=2)
    assert int(bench.read(0x6041)) & LIMIT
    assert not int(bench.read(0x6041)) & REACHED


def test_max_acceleration() -> None:
    """60C5h = 100 rad/s² bounds 6083h = 500 rad/s²."""
    bench = velocity_bench()
    bench.write(0x60C5, bench.units(100.0))
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(100)
    assert bench.read(0x606B) == pytest.approx(bench.units(10.0), rel=0.01)


@pytest.mark.parametrize(("index", "sign", "other"), [(0x60E0, 1, 0x60E1), (0x60E1, -1, 0x60E0)])
def test_torque_limits_of_each_direction(index: int, sign: int, other: int) -> None:
    """60E0h bounds torque forwards, 60E1h backwards; 6072h both."""
    bench = DriveBench()
    for ramp in (0x6083, 0x6084):
        bench.write(ramp, bench.units(1e4))
    bench.write(index, 120)
    bench.write(other, 300)
    bench.enable(PROFILE_VELOCITY)
    for direction, expected in ((sign, 120), (-sign, 300)):
        bench.write(0x60FF, direction * bench.units(100.0))
        bench.sync(20)
        assert bench.read(0x6074) == direction * expected
        assert int(bench.read(0x6041)) & LIMIT
    bench.write(0x6072, 80)
    bench.sync(2)
    assert abs(bench.read(0x6074)) == 80


def test_a_torque_limit_that_comes_by_pdo_holds_from_the_next_cycle_on() -> None:
    """6072h mapped into RPDO 4, with each frame another value."""
    bench = velocity_bench()
    identifier = 0x500 + bench.configuration.node_id
    for index, subindex, value in ((0x1403, 1, 1 << 31 | identifier), (0x1603, 0, 0), (0x1603, 1, 0x6072_0010), (0x1603, 0, 1)):
        bench.write(index, value, subindex)
    bench.write(0x1403, 1, 2)
    bench.write(0x1403, identifier, 1)
    bench.virtual.receive(can.Message(arbitration_id=0, data=b"\x01\x00", is_extended_id=False))
    for ramp in (0x6083, 0x6084):
        bench.write(ramp, bench.units(1e4))
    bench.write(0x60FF, bench.units(100.0))
    for limit in (90, 60):
        bench.virtual.receive(can.Message(arbitration_id=identifier, data=struct.pack("<H", limit), is_extended_id=False))
        bench.sync(3)
        assert abs(bench.read(0x6074)) == limit


def test_velocity_window_and_time() -> None:
    """606Dh = 2 rad/s for 606Eh = 50 ms."""
    bench = velocity_bench()
    bench.drive.axis.servo.parameters["integral_rate"] = 100.0
    bench.write(0x606D, 65_535)
    bench.write(0x606E, 50)
    bench.write(0x60FF, bench.units(SPEED))
    rows = bench.record(400, 0x606C, 0x6041)
    within = abs(rows[:, 0] - bench.units(SPEED)) < 65_535
    reached = rows[:, 1].astype(int) & REACHED != 0
    assert reached.any()
    for cycle in range(60, 400):
        assert reached[cycle] == within[cycle - 49 : cycle + 1].all()


def test_velocity_threshold_and_time() -> None:
    """Bit 12 falls when 606Fh has been exceeded for 6070h = 30 ms."""
    bench = velocity_bench()
    bench.write(0x606F, 60_000)
    bench.write(0x6070, 30)
    bench.write(0x60FF, bench.units(SPEED))
    rows = bench.record(100, 0x606C, 0x6041)
    moving = rows[:, 0] >= 60_000
    standing = rows[:, 1].astype(int) & STANDING != 0
    first = int(moving.argmax())
    assert standing[: first + 29].all()
    assert not standing[first + 30 :].any()


def test_following_error_is_told() -> None:
    """60F4h is the demand less the actual position."""
    bench = DriveBench("scara", "rotate")
    bench.enable(CYCLIC)
    bench.write(0x607A, bench.units(0.5))
    bench.sync()
    for _ in range(20):
        bench.sync()
        state = bench.drive.axis.servo.state
        assert bench.read(0x60F4) == pytest.approx(bench.units(float(state["following_error"])), abs=1)
    assert bench.read(0x60F4) != 0
