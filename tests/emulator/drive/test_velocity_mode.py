"""CiA 402-2, clause 'Velocity mode': the ramp function generator of a frequency converter; against closed forms."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLE, ENABLE, DriveBench

VELOCITY = 2
RUN = ENABLE | 0x70
"""Enable ramp, unlock ramp, reference ramp."""

RPM = 2.0 * pi / 60.0


def demanded(bench: DriveBench, cycles: int) -> np.ndarray:
    """Demanded motor speed [rad/s] at the end of each cycle."""
    rows = []
    for _ in range(cycles):
        bench.sync()
        rows.append(float(bench.drive.axis.servo.demand[-1, 1]))
    return np.array(rows)


def vl_bench() -> DriveBench:
    bench = DriveBench()
    for index, speed, time in ((0x6048, 600, 1), (0x6049, 1200, 1)):
        bench.write(index, speed, 1)
        bench.write(index, time, 2)
    bench.enable(VELOCITY)
    bench.command(RUN)
    return bench


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


@pytest.mark.parametrize(("option", "rate"), [(1, 1200.0), (2, 2400.0)])
def test_quick_stop_of_velocity_mode(option: int, rate: float) -> None:
    """605Ah = 1 slows down by 6049h = 1200 rpm a second, 605Ah = 2 by 604Ah = 4800 rpm in two seconds."""
    bench = vl_bench()
    bench.write(0x604A, 4800, 1)
    bench.write(0x604A, 2, 2)
    bench.write(0x605A, option)
    bench.write(0x6042, 120)
    bench.sync(300)
    speed = float(bench.drive.axis.servo.state["velocity"])
    bench.write(0x6040, 0x02)
    rows = demanded(bench, 40)
    assert np.abs(rows - np.maximum(speed - rate * RPM * CYCLE * np.arange(1, 41), 0.0)).max() < 0.04
