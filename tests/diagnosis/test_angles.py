"""An angle comes back after a turn: an interval of a turn or more says that the recordings do not determine it."""

from __future__ import annotations

from math import inf, nan, pi
from typing import Any

import pytest
from report_case import placed

from drivetwin.diagnosis.propose.search import ANGLES
from drivetwin.diagnosis.report.build import _estimates
from drivetwin.diagnosis.report.result import TWO_SIDED_90, Estimate
from drivetwin.diagnosis.report.wording import estimate_words
from drivetwin.diagnosis.weigh.refit import Refitted
from drivetwin.emulator.effects import library
from drivetwin.emulator.effects.base import ANGLE

NOTHING: Any = None
"""What an angle's interval does not need: the machine and the state of the search."""


def test_the_angles_are_the_parameters_whose_unit_is_an_angle() -> None:
    assert set(ANGLES) == {one.name for kind in library().values() for one in kind.parameters if one.unit == ANGLE}


@pytest.mark.parametrize("deviation", [5.0, 2.0, inf, nan])
def test_an_angle_is_at_most_half_a_turn_off(deviation: float) -> None:
    ripple = placed("torque_ripple", amplitude=0.11, order=24.0, phase=-2.32)
    values = Refitted(NOTHING, (ripple,), [{"amplitude": 0.01, "order": 0.1, "phase": deviation}], {}, {}, {})
    told = _estimates(NOTHING, values, ripple)
    assert told["phase"].value == -2.32
    assert told["phase"].ci90 == pytest.approx((-2.32 - pi, -2.32 + pi))
    assert told["order"].ci90 == pytest.approx((24.0 - 0.1 * TWO_SIDED_90, 24.0 + 0.1 * TWO_SIDED_90))


def test_an_angle_that_is_determined_keeps_its_interval() -> None:
    ripple = placed("torque_ripple", amplitude=0.11, order=24.0, phase=3.0)
    values = Refitted(NOTHING, (ripple,), [{"amplitude": 0.01, "order": 0.1, "phase": 0.5}], {}, {}, {})
    half = 0.5 * TWO_SIDED_90
    assert _estimates(NOTHING, values, ripple)["phase"].ci90 == pytest.approx((3.0 - half, 3.0 + half))


@pytest.mark.parametrize("value", [-2.32, 0.1, 1e3 / 7.0])
def test_an_interval_of_a_turn_is_told_in_words(value: float) -> None:
    assert estimate_words("phase", Estimate(value, "rad", (value - pi, value + pi))) == "phase not determined"
    assert estimate_words("phase", Estimate(-2.32, "rad", (-19.0, 14.3))) == "phase not determined"


def test_what_is_less_than_a_turn_or_no_angle_keeps_its_figures() -> None:
    assert estimate_words("phase", Estimate(0.5, "rad", (-2.5, 3.5))) == "phase 0.5 (-2.5 to 3.5) rad"
    assert estimate_words("rest", Estimate(4.0, "rad", (-9.0, 17.0))) == "rest 4 (-9 to 17) rad", "a place, many turns away"
