"""CiA 402-2, clause 'Factor group', and its factors of DSP 402 version 2: what a user unit is of the motor's turns."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLIC, PROFILE_VELOCITY, DriveBench

from drivetwin.emulator.canopen import SdoAbort

INCREMENTS = 1048576
FACTORS = (0x6093, 0x6094, 0x6095, 0x6096, 0x6097)


def turning(bench: DriveBench, speed: float) -> None:
    """Steadily, at a demanded motor speed [rad/s]."""
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, round(speed * bench.drive.axis.scaling.velocity_per_radian))
    bench.sync(300)


def fraction(bench: DriveBench, index: int, numerator: int, divisor: int) -> None:
    bench.write(index, numerator, 1)
    bench.write(index, divisor, 2)


def demanded_speed(bench: DriveBench) -> float:
    """[rad/s]"""
    return float(bench.drive.axis.servo.demand[-1, 1])


def turned(bench: DriveBench, start: float) -> float:
    """Turns of the motor since it stood at `start` [rad]."""
    return (bench.motor - start) / (2.0 * pi)


def test_factors_are_neutral_at_power_on() -> None:
    bench = DriveBench()
    assert [(bench.read(index, 1), bench.read(index, 2)) for index in FACTORS] == [(1, 1)] * 5
    bench.sync()
    scaling = bench.drive.axis.scaling
    assert scaling.position_per_radian == scaling.velocity_per_radian == scaling.acceleration_per_radian
    assert scaling.position_per_radian == pytest.approx(INCREMENTS / (2.0 * pi))


def test_position_factor_is_the_encoder_resolution_times_the_gear_over_the_feed() -> None:
    """A gear of 50 and 360 units a turn of the joint: 6093h = 1048576 * 50 / 360 moves it as 608Fh, 6091h, 6092h do."""
    by_parts, by_factor = DriveBench("scara", "rotate"), DriveBench("scara", "rotate")
    fraction(by_parts, 0x6091, 50, 1)
    fraction(by_parts, 0x6092, 360, 1)
    fraction(by_factor, 0x6093, INCREMENTS * 50, 360)
    for bench in (by_parts, by_factor):
        bench.enable(CYCLIC)
        start = bench.motor
        for target in range(11):
            bench.write(0x607A, target)
            bench.sync(50)
        bench.sync(400)
        assert turned(bench, start) == pytest.approx(10.0 / 360.0 * 50.0, abs=1e-3)
        assert bench.read(0x6064) == 10


def test_position_factor_goes_before_its_parts() -> None:
    """A master of version 2 writes the parts and their result: the result counts, once."""
    bench = DriveBench()
    fraction(bench, 0x6091, 50, 1)
    fraction(bench, 0x6092, 360, 1)
    fraction(bench, 0x6093, INCREMENTS * 50, 360)
    bench.sync()
    assert bench.drive.axis.scaling.position_per_radian * 2.0 * pi == pytest.approx(360.0 / 50.0)


def test_velocity_encoder_factor() -> None:
    """6094h = 1048576 : 60 is rpm of the motor: increments a second of a unit."""
    bench = DriveBench()
    fraction(bench, 0x6094, INCREMENTS, 60)
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, 300)
    bench.sync(300)
    assert demanded_speed(bench) == pytest.approx(300.0 * 2.0 * pi / 60.0)
    assert bench.read(0x606B) == 300
    assert bench.read(0x606C) == pytest.approx(bench.joint_velocity * bench.configuration.gear_ratio * 60.0 / (2.0 * pi), abs=2)
    assert bench.read(0x6064) > INCREMENTS  # positions stay increments


def test_velocity_factor() -> None:
    """6096h = 1000 : 1 over position units of an increment: a velocity unit is 1000 increments a second."""
    bench = DriveBench()
    fraction(bench, 0x6096, 1000, 1)
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, 3000)
    bench.sync(300)
    assert demanded_speed(bench) == pytest.approx(3e6 * 2.0 * pi / INCREMENTS)


def test_velocity_factor_1_makes_velocity_units_of_the_motor_speed() -> None:
    """6080h = 120 with 6095h = 1048576 : 30: 120 * 1048576 / 30 increments a second are 4 turns a second, not 2."""
    bench = DriveBench()
    bench.write(0x6080, 120)
    turning(bench, 100.0)
    assert demanded_speed(bench) == pytest.approx(2.0 * 2.0 * pi)
    fraction(bench, 0x6095, INCREMENTS, 30)
    bench.sync(300)
    assert demanded_speed(bench) == pytest.approx(4.0 * 2.0 * pi)
    bench.sync(2)
    assert bench.drive.axis.servo.parameters["overspeed"] == pytest.approx(1.2 * 4.0 * 2.0 * pi)


def test_acceleration_factor() -> None:
    """6097h = 1048576 : 1 is turns a second squared: 20 of them for 100 ms are 2 turns a second."""
    bench = DriveBench()
    fraction(bench, 0x6097, INCREMENTS, 1)
    bench.write(0x6083, 20)
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, 100 * INCREMENTS)
    bench.sync(100)
    assert demanded_speed(bench) == pytest.approx(2.0 * 2.0 * pi, rel=1e-6)


def test_accelerations_follow_the_velocity_unit_where_they_have_no_factor() -> None:
    """6094h in rpm: 6083h in rpm a second."""
    bench = DriveBench()
    fraction(bench, 0x6094, INCREMENTS, 60)
    bench.write(0x6083, 1200)
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, 6000)
    bench.sync(100)
    assert bench.read(0x606B) == 120


@pytest.mark.parametrize("index", FACTORS)
@pytest.mark.parametrize("sub", [1, 2])
def test_a_factor_of_zero_is_refused(index: int, sub: int) -> None:
    with pytest.raises(SdoAbort):
        DriveBench().write(index, 0, sub)


def test_scaling_to_millidegrees_of_the_joint() -> None:
    """6091h = 50:1, 6092h = 360000:1: a turn of the joint is 360000 units."""
    bench = DriveBench("scara", "rotate")
    for index, subindex, value in ((0x6091, 1, 50), (0x6091, 2, 1), (0x6092, 1, 360_000), (0x6092, 2, 1)):
        bench.write(index, value, subindex)
    bench.enable(CYCLIC)
    start = bench.joint
    for target in np.linspace(0.0, 10_000.0, 500):
        bench.write(0x607A, round(target))
        bench.sync()
    speed = bench.joint_velocity
    assert bench.read(0x606C) == pytest.approx(speed * 180.0 / pi * 1000.0, rel=0.02)
    bench.sync(500)
    assert (bench.joint - start) * 180.0 / pi == pytest.approx(10.0, abs=0.002)
    assert bench.read(0x6064) == pytest.approx((bench.joint - start) * 180.0 / pi * 1000.0, abs=1.0)
    assert bench.read(0x6063) == pytest.approx((bench.joint - start) * 50.0 / (2.0 * pi) * 1048576, abs=1.5)


def test_scaling_to_micrometres_with_another_resolution() -> None:
    """608Fh = 2097152:2 is the encoder's own; a screw of 10 mm a turn as 6092h = 30000:3 um."""
    bench = DriveBench()
    for index, subindex, value in ((0x608F, 1, 2_097_152), (0x608F, 2, 2), (0x6092, 1, 30_000), (0x6092, 2, 3)):
        bench.write(index, value, subindex)
    bench.write(0x6083, 200_000)
    bench.enable(PROFILE_VELOCITY)
    start = bench.joint
    bench.write(0x60FF, 50_000)
    bench.sync(500)
    assert bench.read(0x606B) == 50_000
    assert bench.read(0x6064) == pytest.approx((bench.joint - start) * 1e6, rel=1e-3)
    assert bench.read(0x6064) > 5_000


def test_polarity() -> None:
    """607Eh bit 7 turns positions round, bit 6 velocities, each alone."""
    bench = DriveBench()
    bench.write(0x6083, bench.units(500.0))
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, bench.units(20.0))
    bench.sync(200)
    position, velocity = bench.read(0x6064), bench.read(0x606C)
    assert position > 0
    assert velocity > 0
    for polarity, signs in ((0x80, (-1, 1)), (0x40, (1, -1)), (0xC0, (-1, -1))):
        bench.write(0x607E, polarity)
        assert bench.read(0x6064) == pytest.approx(signs[0] * position, abs=1)
        assert bench.read(0x606C) == pytest.approx(signs[1] * velocity, abs=1)
    bench.sync(400)
    assert bench.joint_velocity < 0.0


# -- what a ServoOne has beside it ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("index", "role"), [(0x6089, "position"), (0x608B, "velocity"), (0x608D, "acceleration")])
def test_a_notation_index_is_the_power_of_ten_of_the_unit(index: int, role: str) -> None:
    bench = DriveBench(profile="servoone")
    bench.sync()
    before = vars(bench.drive.axis.scaling)
    bench.write(index, -3)
    bench.sync()
    after = vars(bench.drive.axis.scaling)
    for name in ("position", "velocity", "acceleration"):
        ratio = after[f"{name}_per_radian"] / before[f"{name}_per_radian"]
        follows = name == role
        assert ratio == pytest.approx(1000.0 if follows else 1.0)


@pytest.mark.parametrize("value", [-13, 13, 64, 127])
def test_a_notation_index_that_is_no_power_of_ten_is_refused(value: int) -> None:
    """From 64 on the indices are units without decimal steps."""
    with pytest.raises(SdoAbort):
        DriveBench(profile="servoone").write(0x6089, value)


@pytest.mark.parametrize("index", [0x608A, 0x608C, 0x608E])
def test_a_dimension_is_refused(index: int) -> None:
    """A position unit has the dimension of the feed constant, which the drive is not told."""
    bench = DriveBench(profile="servoone")
    bench.write(index, 0)
    with pytest.raises(SdoAbort):
        bench.write(index, 0x41)


def test_velocity_encoder_resolution_is_the_encoders_own() -> None:
    bench = DriveBench(profile="servoone")
    assert (bench.read(0x6090, 1), bench.read(0x6090, 2)) == (INCREMENTS, 1)
    bench.write(0x6090, INCREMENTS, 1)
    for sub in (1, 2):
        with pytest.raises(SdoAbort):
            bench.write(0x6090, 2048, sub)
