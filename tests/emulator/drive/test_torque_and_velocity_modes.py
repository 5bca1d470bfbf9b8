"""Profile torque, cyclic synchronous torque and velocity, velocity mode (CiA 402-2), on the stage and against closed forms."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLE, ENABLE, DriveBench

VELOCITY, TORQUE, CYCLIC_VELOCITY, CYCLIC_TORQUE = 2, 4, 9, 10
REACHED, FOLLOWS = 1 << 10, 1 << 12
RUN = ENABLE | 0x70
"""Velocity mode: enable ramp, unlock ramp, reference ramp."""


def demanded(bench: DriveBench, cycles: int) -> np.ndarray:
    """Demanded motor speed [rad/s] at the end of each cycle."""
    rows = []
    for _ in range(cycles):
        bench.sync()
        rows.append(float(bench.drive.axis.servo.demand[-1, 1]))
    return np.array(rows)


def test_torque_goes_by_its_slope() -> None:
    """6071h = 400 by 6087h = 2000 thousandths a second: 200 ms; bit 10 at the end."""
    bench = DriveBench()
    bench.write(0x6087, 2000)
    bench.enable(TORQUE)
    bench.write(0x6071, 400)
    rows = bench.record(210, 0x6074, 0x6041)
    expected = np.minimum(2.0 * np.arange(1, 211), 400.0)
    assert np.abs(rows[:, 0] - expected).max() <= 1.0
    reached = rows[:, 1].astype(int) & REACHED != 0
    assert not reached[:195].any()
    assert reached[205:].all()


def test_torque_accelerates_the_stage() -> None:
    bench = DriveBench()
    bench.enable(TORQUE)
    bench.write(0x6071, 150)
    bench.sync(20)
    before = bench.joint_velocity
    bench.sync(100)
    force = 0.15 * 0.4 * bench.configuration.gear_ratio - 20.4 - (203.5 - 36.0) * 0.5 * (before + bench.joint_velocity)
    assert (bench.joint_velocity - before) / 0.1 == pytest.approx(force / 95.0014, rel=0.01)


def test_motor_speed_limit_in_torque_mode() -> None:
    """6080h bounds the speed that a torque without load would run up to."""
    bench = DriveBench()
    bench.write(0x6080, 100)
    bench.enable(TORQUE)
    bench.write(0x6071, 800)
    bench.sync(1000)
    limit = 100.0 * 2.0 * pi / 60.0
    assert bench.joint_velocity * bench.configuration.gear_ratio == pytest.approx(limit, rel=0.2)
    assert bench.joint_velocity * bench.configuration.gear_ratio < limit
    assert int(bench.read(0x6041)) & 1 << 11


@pytest.mark.parametrize("offset", [0, 50])
def test_cyclic_torque_follows_each_cycle(offset: int) -> None:
    """6071h plus 60B2h, at once; bit 12: the drive follows the command."""
    bench = DriveBench()
    bench.write(0x60B2, offset)
    bench.enable(CYCLIC_TORQUE)
    for target in (100, -100, 30, 0):
        bench.write(0x6071, target)
        bench.sync()
        assert bench.read(0x6074) == target + offset
        assert int(bench.read(0x6041)) & FOLLOWS


def test_cyclic_velocity_follows_each_cycle() -> None:
    """A straight line from set-point to set-point, plus 60B1h."""
    bench = DriveBench()
    bench.enable(CYCLIC_VELOCITY)
    wanted = 20.0 * np.sin(2.0 * pi * np.arange(1, 301) / 300.0)
    for speed in wanted:
        bench.write(0x60FF, bench.units(float(speed)))
        bench.sync()
        assert float(bench.drive.axis.servo.demand[-1, 1]) == pytest.approx(speed, abs=1e-4)
        slope = np.diff(bench.drive.axis.servo.demand[:, 1])
        assert np.ptp(slope) < 1e-6
    assert int(bench.read(0x6041)) & FOLLOWS
    bench.write(0x60FF, 0)
    bench.write(0x60B1, bench.units(3.0))
    bench.sync(2)
    assert bench.read(0x606B) == pytest.approx(bench.units(3.0), abs=1)


def vl_bench() -> DriveBench:
    bench = DriveBench()
    for index, speed, time in ((0x6048, 600, 1), (0x6049, 1200, 1)):
        bench.write(index, speed, 1)
        bench.write(index, time, 2)
    bench.enable(VELOCITY)
    bench.command(RUN)
    return bench


RPM = 2.0 * pi / 60.0


def test_velocity_mode_ramps() -> None:
    """6042h = 120 rpm by 6048h = 600 rpm a second, back by 6049h = 1200 rpm a second."""
    bench = vl_bench()
    bench.write(0x6042, 120)
    rows = demanded(bench, 250)
    assert np.abs(rows - np.minimum(600.0 * RPM * CYCLE * np.arange(1, 251), 120.0 * RPM)).max() < 0.02
    assert bench.read(0x6043) == pytest.approx(120, abs=1)
    assert bench.read(0x6044) == pytest.approx(120, rel=0.2)
    bench.write(0x6042, 0)
    rows = demanded(bench, 120)
    assert np.abs(rows - np.maximum(120.0 * RPM - 1200.0 * RPM * CYCLE * np.arange(1, 121), 0.0)).max() < 0.03


@pytest.mark.parametrize(("controlword", "share"), [(RUN & ~0x10, 0.0), (RUN & ~0x20, 1.0), (RUN & ~0x40, 0.0)])
def test_velocity_mode_controlword_bits(controlword: int, share: float) -> None:
    """Without bit 4 the ramp is not used, without bit 5 it stands where it is, without bit 6 its input is 0."""
    bench = vl_bench()
    bench.write(0x6042, 120)
    before = demanded(bench, 100)[-1]
    bench.command(controlword)
    assert demanded(bench, 200)[-1] == pytest.approx(share * before, abs=0.05)


@pytest.mark.parametrize(("target", "expected"), [(10, 30), (-10, -30), (60, 60), (500, 90), (-500, -90), (0, 0)])
def test_velocity_amounts(target: int, expected: int) -> None:
    """6046h: 30..90 rpm; statusword bit 11 where it cuts."""
    bench = vl_bench()
    bench.write(0x6046, 30, 1)
    bench.write(0x6046, 90, 2)
    bench.write(0x6042, target)
    assert demanded(bench, 300)[-1] == pytest.approx(expected * RPM)
    assert bool(int(bench.read(0x6041)) & 1 << 11) == (target != expected)


def test_velocity_dimension_factor() -> None:
    """604Ch = 1:10: tenths of a turn a minute."""
    bench = vl_bench()
    bench.write(0x604C, 10, 2)
    bench.write(0x6042, 900)
    assert demanded(bench, 1600)[-1] == pytest.approx(90.0 * RPM)
    assert bench.read(0x6043) == pytest.approx(900, abs=1)
