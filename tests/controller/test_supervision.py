"""A leap of the encoder is told from a host that stood still for a moment."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.supervision import Watch, jump

PERIOD, STALL = 0.002, 0.06
SPEED, FULL_SPEED, UNIT = 2.0, 2.5, 1e-6


def watched(steps: list[tuple[float, float]]) -> list[str]:
    """What is said of an axis after each step: seconds since the last cycle, and the way that its encoder tells [rad]."""
    axis, liveness = SimpleNamespace(max_speed=FULL_SPEED), SimpleNamespace(silence=0.0)
    drive = SimpleNamespace(streaming=True, homed=True, operating=False, received=1, position=0, unit=UNIT, node_id=2)
    vars(drive).update(axis=axis, liveness=liveness, where=lambda: "axis rotate")
    watch, said = Watch(cast(DriveNode, drive), PERIOD), []
    for elapsed, way in steps:
        drive.position += round(way / UNIT)
        watch.count(elapsed)
        trouble = jump(watch)
        said.append(str(trouble) if trouble else "")
        watch.keep()
    return said


MOVING = [(PERIOD, SPEED * PERIOD)] * 3


def test_an_axis_that_moves_on_while_the_host_stands_still_has_not_leapt() -> None:
    assert watched([*MOVING, (STALL, SPEED * STALL), *MOVING]) == [""] * 7


def test_nor_one_that_has_come_to_rest_meanwhile() -> None:
    assert watched([*MOVING, (STALL, 0.5 * SPEED * STALL), (PERIOD, 0.0)]) == [""] * 5


def test_nor_one_whose_next_sync_makes_up_for_a_late_one() -> None:
    late, early = (0.0031, FULL_SPEED * PERIOD), (0.0009, FULL_SPEED * PERIOD)  # a drive's clock goes from SYNC to SYNC evenly
    assert watched([*MOVING, late, early]) == [""] * 5


def test_as_much_within_one_cycle_is_a_leap() -> None:
    *before, last = watched([*MOVING, (PERIOD, SPEED * STALL)])
    assert before == [""] * 3
    assert "reports a position 0.12 from where it was 2 ms before, and cannot have moved that far" in last
