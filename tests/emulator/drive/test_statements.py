"""What CiA 402-2 leaves open and docs/conformance-402.md states: bit 10 of mode 7, 607Dh in the torque modes."""

from __future__ import annotations

import pytest
from drive_bench import INTERPOLATED, START, DriveBench

LIMIT, REACHED = 1 << 11, 1 << 10
HALT = START | 1 << 8
PROFILE_TORQUE, CYCLIC_TORQUE = 4, 10


def test_no_set_point_of_mode_7_is_the_last_one() -> None:
    """Bit 10 stays 0, moving or standing at the last set-point, until a halt has ended."""
    bench = DriveBench("scara", "rotate")
    bench.enable(INTERPOLATED)
    bench.command(START)
    bench.write(0x60C1, bench.units(0.02), 1)
    for _ in range(300):
        bench.sync()
        assert not int(bench.read(0x6041)) & REACHED
    bench.command(HALT)
    bench.sync(300)
    assert int(bench.read(0x6041)) & REACHED


@pytest.mark.parametrize("mode", [PROFILE_TORQUE, CYCLIC_TORQUE])
def test_a_torque_mode_has_no_position_demand_that_607dh_could_limit(mode: int) -> None:
    """The axis passes the limit by its torque, without a fault; bit 11 says nothing of a position."""
    bench = DriveBench()
    bench.write(0x607D, bench.units(-1.0), 1)
    bench.write(0x607D, bench.units(1.0), 2)
    bench.enable(mode)
    bench.write(0x6071, 200)
    for _ in range(3000):
        bench.sync()
        assert not int(bench.read(0x6041)) & LIMIT
        if bench.read(0x6064) > bench.units(1.5):
            break
    assert bench.read(0x6064) > bench.units(1.5)
    assert bench.emergencies() == []
