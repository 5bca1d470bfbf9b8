"""CiA 402-2, clause 'Profile torque mode': slope, halt, speed limit; against the plant's acceleration."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLE, ENABLE, HALT, DriveBench

from drivetwin.emulator.drive.state_machine import State

TORQUE = 4
REACHED = 1 << 10


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
    bench.write(0x6087, 0)
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


@pytest.mark.parametrize("offset", [0, 20])
def test_halt_takes_the_torque_back_by_its_slope(offset: int) -> None:
    """605Dh = 1: 200 thousandths by 6087h = 2000 a second; bit 10 when the axis has rolled out; then on again."""
    bench = DriveBench()
    bench.write(0x6087, 2000)
    bench.write(0x60B2, offset)
    bench.enable(TORQUE)
    bench.write(0x6071, 200)
    bench.sync(150)
    bench.write(0x6040, HALT)
    rows = bench.record(120, 0x6074)[:, 0]
    expected = np.maximum(200.0 + offset - 2.0 * np.arange(1, 121), 0.0)
    assert np.abs(rows - expected).max() <= 1.0
    assert not int(bench.read(0x6041)) & REACHED
    bench.sync(1500)
    assert abs(bench.joint_velocity) < 1e-6
    assert int(bench.read(0x6041)) & REACHED
    bench.command(ENABLE)
    rows = bench.record(120, 0x6074)[:, 0]
    assert rows[-1] == 200 + offset
    assert np.diff(rows).max() <= 3.0


def test_halt_by_the_quick_stop_ramp_slows_the_axis_down() -> None:
    """605Dh = 2 is a ramp of the speed, in this mode too."""
    bench = DriveBench()
    bench.write(0x605D, 2)
    bench.write(0x6085, bench.units(200.0))
    bench.enable(TORQUE)
    bench.write(0x6071, 200)
    bench.sync(100)
    speed = bench.joint_velocity * bench.configuration.gear_ratio
    bench.write(0x6040, HALT)
    bench.sync(round(speed / 200.0 / CYCLE) + 80)
    assert abs(bench.joint_velocity) < 1e-4
    assert bench.state is State.OPERATION_ENABLED


def test_a_torque_that_a_limit_cuts_is_not_reached() -> None:
    """CiA 402-2, 'Profile torque mode', bit 10: 6072h = 10 % where 6071h asks for 15 %."""
    bench = DriveBench()
    bench.write(0x6072, 100)
    bench.write(0x6087, 0)
    bench.enable(TORQUE)
    bench.write(0x6071, 150)
    bench.sync(5)
    assert int(bench.read(0x6041)) & (1 << 10 | 1 << 11) == 1 << 11
    bench.write(0x6071, 50)
    bench.sync(5)
    assert int(bench.read(0x6041)) & (1 << 10 | 1 << 11) == 1 << 10
