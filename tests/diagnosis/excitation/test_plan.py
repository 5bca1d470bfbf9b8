"""Every motion within its limits, whatever they are; a motion for every effect of the library; nothing leaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.choice import EXCITATIONS, Question, chosen
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, joined
from drivetwin.diagnosis.excitation.plan import plan
from drivetwin.diagnosis.excitation.sweep import Sweep
from drivetwin.emulator.effects import AxisEffect, DriveEffect, ModelEffect, library
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import MotionLimits

PERIOD = 0.001
ARM = AxisLimits((-1.2, 1.4), MotionLimits(2.0, 15.0, 300.0))
STAGE = AxisLimits((0.0, 0.22), MotionLimits(0.15, 1.0, 20.0))
TURN = AxisLimits((-3.0, 3.0), MotionLimits(0.8, 2.0, 8.0))

some_limits = st.builds(
    lambda low, room, speed, acceleration, jerk: AxisLimits((low, low + room), MotionLimits(speed, acceleration, jerk)),
    st.floats(-5.0, 5.0),
    st.floats(0.05, 6.0),
    st.floats(0.05, 3.0),
    st.floats(0.5, 30.0),
    st.floats(5.0, 1000.0),
)


def assert_within(path: Path, limits: AxisLimits) -> None:
    """Differences of samples are means of the derivatives; rounding of positions is all that may be beyond."""
    assert path.min() >= limits.travel[0] - 1e-9
    assert path.max() <= limits.travel[1] + 1e-9
    rounding = 8.0 * float(np.finfo(np.float64).eps) * max(1.0, float(np.abs(path).max()))
    for order, most in enumerate((limits.most.speed, limits.most.acceleration, limits.most.jerk), start=1):
        assert np.abs(np.diff(path, order)).max() <= most * PERIOD**order * (1.0 + 1e-9) + 2**order * rounding


@pytest.mark.parametrize("excitation", EXCITATIONS, ids=lambda one: one.name)
@pytest.mark.parametrize("limits", [ARM, STAGE, TURN], ids=["arm", "stage", "turn"])
def test_every_motion_stays_within_its_limits(excitation: Excitation, limits: AxisLimits) -> None:
    assert_within(joined(excitation.pieces(limits, PERIOD), limits, PERIOD), limits)


@settings(max_examples=8, deadline=None)
@given(some_limits)
def test_the_whole_motion_stays_within_any_limits(limits: AxisLimits) -> None:
    question = Question("axis", ("stribeck", "elasticity", "gravity", "inertia", "presliding"), "")
    assert_within(plan(question, {"axis": limits}, PERIOD).paths["axis"], limits)


def test_every_effect_that_a_diagnosis_looks_for_has_a_motion() -> None:
    for name, kind in library().items():
        if issubclass(kind, (AxisEffect, DriveEffect, ModelEffect)):
            assert chosen([name]), name


def test_only_what_the_question_needs_is_moved() -> None:
    found = plan(Question("axis", ("stribeck", "viscous_nonlinear"), ""), {"axis": ARM, "other": TURN}, PERIOD)
    assert [each.excitation.name for each in found.passages] == ["slow_strokes", "speed_levels"]
    assert list(found.paths) == ["axis"]


def test_a_payload_is_looked_for_at_three_poses_of_the_other_axes_which_stand_meanwhile() -> None:
    found = plan(Question("axis", ("payload", "inertia"), ""), {"axis": ARM, "other": TURN}, PERIOD)
    assert len({tuple(each.pose.items()) for each in found.passages}) == 3
    assert_within(found.paths["other"], TURN)
    assert len(found.paths["axis"]) == len(found.paths["other"])
    for each in found.passages:
        span = slice(round(each.begin / PERIOD) + 1, round(each.end / PERIOD) - 1)
        assert np.ptp(found.paths["other"][span]) == 0.0
        assert found.paths["other"][span][0] == pytest.approx(each.pose["other"])
        assert np.ptp(found.paths["axis"][span]) > 0.1


def test_slow_strokes_are_as_slow_as_they_say() -> None:
    path = plan(Question("axis", ("stribeck",), ""), {"axis": ARM}, PERIOD).paths["axis"]
    speed = np.abs(np.diff(path)) / PERIOD
    assert np.mean((speed > 0.0) & (speed < 0.1 * ARM.most.speed)) > 0.3


def test_an_axis_without_limits_is_refused() -> None:
    with pytest.raises(UserError, match="no axis 'axis'; they have other"):
        plan(Question("axis", ("stribeck",), ""), {"other": ARM}, PERIOD)


@pytest.mark.parametrize("period", [0.001, 0.008, 0.02])
def test_a_sweep_has_no_sine_that_set_points_cannot_follow(period: float) -> None:
    """A half wave has two set-points at least; a faster one would come out as another."""
    pieces = list(Sweep().pieces(ARM, period))
    for piece in pieces:
        crossings = np.flatnonzero(np.diff(np.sign((piece - ARM.at(0.5))[1:-1])))
        assert np.diff(crossings).min() >= 2
    assert len(pieces) == (2 if period > 0.0166 else 3)
