"""CiA 402-2, clause 'Cyclic synchronous velocity mode'."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import DriveBench

CYCLIC_VELOCITY = 9
FOLLOWS = 1 << 12


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
