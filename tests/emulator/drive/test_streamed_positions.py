"""CiA 402-2, clauses 'Interpolated position mode' and 'Cyclic synchronous position mode': the axis follows what is streamed."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLE, CYCLIC, INTERPOLATED, PROFILE_VELOCITY, START, DriveBench


@pytest.mark.parametrize(
    ("profile", "mode"), [("cia402-full", CYCLIC), ("cia402-full", INTERPOLATED), ("servoone", INTERPOLATED)]
)
def test_the_axis_follows_what_is_streamed(profile: str, mode: int) -> None:
    """A raised cosine of 0.2 rad on rotate; linear reaches each point at its cycle's end, the spline a cycle later."""
    bench = DriveBench("scara", "rotate", profile)
    bench.enable(mode)
    bench.command(START)
    place = (0x60C1, 1) if mode == INTERPOLATED else (0x607A, 0)
    start, gear = bench.motor, bench.configuration.gear_ratio
    origin = bench.read(0x6064)
    moves = 0.1 * gear * (1.0 - np.cos(2.0 * pi * np.arange(501) / 500))
    demanded, errors = [], []
    for angle in moves:
        bench.write(place[0], round(origin + angle * bench.units(1.0)), place[1])
        bench.sync()
        demanded.append(float(bench.drive.axis.servo.demand[-1, 0]) - start)
        errors.append(bench.motor - start - angle)
    spline = profile == "servoone"
    reached = np.array(demanded[1:]) - (moves[:-1] if spline else moves[1:])
    acceleration = 0.1 * gear * (2.0 * pi / 0.5) ** 2
    allowed = 2.0 / bench.units(1.0) + (acceleration * CYCLE**2 / 6.0 if spline else 0.0)
    assert np.abs(reached).max() < allowed
    assert np.abs(errors).max() / gear < 0.01  # followed, to a twentieth of the stroke
    assert np.ptp(np.array(errors)) > 0.0


def test_interpolation_waits_for_bit_4() -> None:
    bench = DriveBench("scara", "rotate")
    bench.enable(INTERPOLATED)
    start = bench.joint
    bench.write(0x60C1, bench.units(1.0), 1)
    bench.sync(100)
    assert bench.joint == pytest.approx(start, abs=1e-7)
    assert not int(bench.read(0x6041)) & 1 << 12
    bench.command(START)
    assert int(bench.read(0x6041)) & 1 << 12
    bench.sync(300)
    assert (bench.joint - start) * 50.0 == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("mode", [CYCLIC, INTERPOLATED])
def test_velocity_offset_is_added_to_the_velocity_demand(mode: int) -> None:
    """On the stage, whose velocity loop is P: 606Bh and 6074h say it while stiction holds the axis."""
    bench = DriveBench()
    bench.enable(mode)
    bench.sync(10)
    still = bench.read(0x606B), bench.read(0x6074)
    offset = 0.5
    bench.write(0x60B1, bench.units(offset))
    bench.sync()
    gain = 8500.0 / bench.configuration.gear_ratio**2
    assert bench.read(0x606B) - still[0] == pytest.approx(bench.units(offset), abs=101)  # an increment by 1/s
    assert bench.read(0x6074) - still[1] == pytest.approx(1000.0 * gain * offset / 0.4, abs=1.0)


@pytest.mark.parametrize("mode", [CYCLIC, INTERPOLATED, PROFILE_VELOCITY])
def test_torque_offset_is_added_to_the_torque_demand(mode: int) -> None:
    bench = DriveBench()
    bench.enable(mode)
    bench.sync(10)
    bench.write(0x60B2, 50)
    bench.sync(20)
    assert bench.read(0x6074) == pytest.approx(50, abs=1)
    assert bench.read(0x6077) == pytest.approx(50, abs=4.0 * 4.0 + 1)  # noise of 0.4 % of rated torque
    assert bench.virtual.plant.motor_torque[0] == pytest.approx(0.05 * 0.4, rel=0.02)
