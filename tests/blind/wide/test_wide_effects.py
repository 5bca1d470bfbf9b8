"""What effects of the wide generator can be, however large they are asked to be."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.blind.wide.effects import LIBRARY, MOST_PLAY, Ground
from drivetwin.blind.wide.machines import AxisLimits, Link, Machine, Nominal

TRAVEL = 0.5


@pytest.mark.parametrize("seed", range(5))
def test_play_is_a_small_part_of_the_travel(seed: int) -> None:
    link = Link("slide", -1, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), True, 3.0, (0.0, 0.0, 0.0), (1e-6, 1e-6, 1e-6))
    limits = AxisLimits(-0.5 * TRAVEL, 0.5 * TRAVEL, 1.0, 5.0, 20.0)
    machine = Machine("test", (link,), (limits,), (Nominal(1.0, 0.1, 2.0, 10.0),))
    ground = Ground(np.random.default_rng(seed), machine, 0, 20.0, 60.0, 3.0, TRAVEL, 0.0, 1.0, -1)
    sizable = LIBRARY["backlash"](ground)
    usual, large = (sizable(factor)["gap"] for factor in (1.0, 1e4))
    assert 2e-4 * TRAVEL <= usual <= 4e-3 * TRAVEL
    assert large == MOST_PLAY * TRAVEL
