"""Torque: its limits, its rated value, its reading on the bus; against the plant's acceleration."""

from __future__ import annotations

from math import pi

import pytest
from drive_bench import CYCLIC, PROFILE_VELOCITY, DriveBench


def test_max_torque_limits() -> None:
    """6072h = 150: 0.06 N·m less friction accelerates the stage, no more."""
    bench = DriveBench()
    bench.write(0x6072, 150)
    bench.write(0x6083, bench.units(1e4))
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, bench.units(100.0))
    bench.sync(20)
    before = bench.joint_velocity
    rows = bench.record(100, 0x6074)
    assert rows.min() == rows.max() == 150
    force = 0.15 * 0.4 * bench.configuration.gear_ratio - 20.4 - (203.5 - 36.0) * 0.5 * (before + bench.joint_velocity)
    assert (bench.joint_velocity - before) / 0.1 == pytest.approx(force / 95.0014, rel=0.01)


def test_torque_limit_follows_the_rated_torque() -> None:
    bench = DriveBench()
    bench.write(0x6072, 500)
    bench.sync()
    assert bench.drive.axis.servo.parameters["torque_limit"] == pytest.approx(0.2)
    bench.write(0x6076, 200)
    bench.sync()
    assert bench.drive.axis.servo.parameters["torque_limit"] == pytest.approx(0.1)


def test_no_object_makes_a_motor_stronger_than_it_is() -> None:
    """The motor's and the power stage's peak torque bounds every limit that a master writes."""
    bench = DriveBench()
    bench.write(0x6072, 65_535)
    bench.write(0x60F9, 1e30, 5)
    bench.sync()
    assert bench.drive.axis.servo.parameters["torque_limit"] == pytest.approx(1.2)


def test_rated_torque_is_one_quantity_in_two_objects() -> None:
    bench = DriveBench(profile="servoone")
    bench.write(0x21CC, 0.25)
    assert bench.read(0x6076) == 250
    bench.write(0x6076, 300)
    assert bench.read(0x21CC) == pytest.approx(0.3)


def test_a_rated_torque_of_zero_is_no_division() -> None:
    bench = DriveBench()
    bench.write(0x6076, 0)
    bench.enable(CYCLIC)
    assert bench.read(0x6077) == 0


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_float_torque_and_per_mille_are_the_same_reading(profile: str) -> None:
    bench = DriveBench("scara", "lift", profile)
    bench.enable(PROFILE_VELOCITY)
    bench.sync(300)
    for _ in range(20):
        bench.sync()
        assert bench.read(0x6077) == pytest.approx(1000.0 * bench.read(0x21A3) / 1.27, abs=0.51)
    assert bench.read(0x21A3) * 2.0 * pi / 0.01 == pytest.approx(17.25 * 9.81, abs=45.0)  # gravity within stiction


@pytest.mark.parametrize(("rated_current", "max_current"), [(2000, 150), (1000, 300)])
def test_max_current_limits(rated_current: int, max_current: int) -> None:
    """6073h in thousandths of 6075h [mA]: 0.3 A of a motor that gives 0.4 N·m at 2 A are 0.06 N·m, in both directions."""
    bench = DriveBench()
    bench.write(0x6075, rated_current)
    bench.write(0x6073, max_current)
    for ramp in (0x6083, 0x6084):
        bench.write(ramp, bench.units(1e4))
    bench.enable(PROFILE_VELOCITY)
    for sign in (1, -1):
        bench.write(0x60FF, sign * bench.units(100.0))
        rows = bench.record(40, 0x6074)[10:]
        assert rows.min() == rows.max() == sign * 150
        assert int(bench.read(0x6041)) & 1 << 11
