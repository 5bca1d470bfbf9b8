"""CiA 402-2, clause 'Cyclic synchronous torque mode'."""

from __future__ import annotations

import pytest
from drive_bench import DriveBench

CYCLIC_TORQUE = 10
FOLLOWS = 1 << 12


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
