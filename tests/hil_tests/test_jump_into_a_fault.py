"""A leap that makes the drive fault in the same cycle is a leap all the same; a drive that lets go is none."""

from __future__ import annotations

import numpy as np
from made_evidence import ROTATE, evidence, found, moved, standing


def test_a_leap_to_which_the_drive_answers_by_a_fault() -> None:
    truth = standing(4.0)
    leap = int(np.searchsorted(truth.time, 2.0))
    truth.enabled[leap:, ROTATE] = False
    truth.demand[leap, ROTATE] += 0.5
    assert found("no_jump", evidence(truth)) == [("rotate", 2.0)]


def test_a_fault_in_motion_after_which_the_demand_is_where_the_axis_is() -> None:
    truth = standing(4.0)
    moved(truth, ROTATE, 0.5, 2.0)
    middle = int(np.searchsorted(truth.time, 1.2))
    truth.position[:middle, ROTATE] -= 0.02  # it lags by more than a cycle's way
    truth.enabled[middle:, ROTATE] = False
    truth.position[middle:, ROTATE] = truth.position[middle - 1, ROTATE]
    truth.demand[middle:, ROTATE] = truth.position[middle, ROTATE]
    assert abs(truth.demand[middle, ROTATE] - truth.demand[middle - 1, ROTATE]) > 0.01
    assert found("no_jump", evidence(truth)) == []
