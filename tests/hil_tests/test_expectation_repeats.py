"""The expectation `repeats`: axes that go to and fro turn where they turned before, or axis, time and spread are told."""

from __future__ import annotations

import pytest
from made_evidence import LIFT, ROTATE, STRETCH, evidence, found, judged, measured, moved, standing

from drivetwin.hil_tests.evidence import Truth


def to_and_fro(ends: list[float]) -> Truth:
    """All axes to each of the ends, one after the other, without a pause of their own."""
    truth = standing(20.0)
    for axis in (LIFT, ROTATE, STRETCH):
        begin = 0.5
        for end in ends:
            begin = moved(truth, axis, begin, end)
    return truth


def test_turning_points_that_are_the_same_have_no_spread() -> None:
    truth = to_and_fro([1.0, 0.0] * 4)
    assert found("repeats", evidence(truth)) == []
    assert measured("repeats", evidence(truth), "rotate") == pytest.approx(0.0, abs=1e-9)


def test_a_drift_of_one_side_is_told() -> None:
    truth = to_and_fro([1.0, 0.0, 1.0001, 0.0, 1.0002, 0.0, 1.0003, 0.0])
    assert measured("repeats", evidence(truth), "rotate") == pytest.approx(3e-4, rel=1e-2)
    assert [axis for axis, _ in found("repeats", evidence(truth))] == ["lift", "rotate", "stretch"]


def test_the_plant_counts_and_not_the_demand() -> None:
    truth = to_and_fro([1.0, 0.0] * 4)
    truth.position[len(truth.time) // 4 :, ROTATE] += 0.001
    assert measured("repeats", evidence(truth), "rotate") == pytest.approx(0.001, rel=1e-2)


def test_a_motion_that_does_not_turn_back_cannot_be_compared() -> None:
    (failure, *_) = judged("repeats", evidence(to_and_fro([1.0, 0.0]))).failures
    assert "too few" in failure.message
