"""Whatever a master writes, the drive raises nothing and the plant lives."""

from __future__ import annotations

from contextlib import suppress
from random import Random

import numpy as np
import pytest
from drive_bench import HALT, START, DriveBench

from drivetwin.drive_profiles import DataType
from drivetwin.emulator.canopen import SdoAbort
from drivetwin.emulator.canopen.data_types import type_range


@pytest.mark.parametrize("seed", range(12))
def test_whatever_is_written_the_plant_lives(seed: int) -> None:
    """Any values in any objects: no exception, and MuJoCo finds nothing bad (it would warn, and reset its time)."""
    random = Random(seed)
    bench = DriveBench("scara", "rotate", random.choice(["servoone", "cia402-full"]))
    writable = [one for one in bench.drive.dictionary if one.access.writable and one.index >= 0x2000 and one.size]
    for _ in range(60):
        for variable in random.sample(writable, 3):
            low, high = type_range(variable.data_type)
            value = random.choice([low, high, 0, 1, random.uniform(0, 100), random.uniform(low, high) / 1000.0])
            with suppress(SdoAbort):
                variable.write(value if variable.data_type is DataType.R32 else int(value))
        bench.write(0x6060, random.choice([3, 6, 7]))
        bench.command(random.choice([6, 7, 15, 15, START, HALT, 2, 0x80]))
        for variable in bench.drive.dictionary:
            if variable.index >= 0x2000:
                variable.encode()
    assert bench.virtual.plant.time == pytest.approx(bench.virtual.now(), abs=1e-9)
    assert np.isfinite(bench.virtual.plant.joint_positions()).all()
