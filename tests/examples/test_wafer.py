"""The slip margin against a free wafer on pads with Coulomb friction in MuJoCo, and against closed forms."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wafer_bench import slip
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.blade_path import Point, blade_line
from wafer_handler.scara.dynamics import GRAVITY
from wafer_handler.scara.wafer import Wafer, blade_motion, slip_margin, turn_limits, wafer_stretch

from drivetwin.controller.joint_path import JointPath, Move, slowed
from drivetwin.controller.synchronised import synchronised
from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

PERIOD = 0.0005
ARM = load_arm()
LINE = MotionLimits(0.3, 2.5, 50.0)
STAYS, SLIDES = 1e-6, 2e-5
"""Metres: the soft contacts creep by 0.05 um."""

CERAMIC = Wafer(friction=0.2)
SLIPPERY = Wafer(friction=0.1)
"""On such a blade friction limits a straight move before the axes do."""


def planned(wafer: Wafer, move: Move, margin: float) -> JointPath:
    """`move`, so slow that its slip margin is `margin` where it is least."""
    path = slowed(move, PERIOD, lambda path: wafer_stretch(wafer, ARM.geometry, path, margin)).sample(PERIOD)
    assert slip_margin(wafer, blade_motion(ARM.geometry, path)).min() == pytest.approx(margin, rel=2e-3)
    return path


STRETCH_MOVES = {
    "level": blade_line(ARM, Point(0.30, 0.0, 0.8), Point(0.60, 0.0, 0.8), LINE, PERIOD),
    "as far down as out": blade_line(ARM, Point(0.30, 0.0, 1.0), Point(0.50, 0.0, 0.8), LINE, PERIOD),
}
"""Along x, the way that the blade leans."""


@pytest.mark.parametrize("move", STRETCH_MOVES.values(), ids=STRETCH_MOVES.keys())
@pytest.mark.parametrize("tilt", [0.0, radians(2.0)], ids=["upright", "leaning"])
def test_a_wafer_that_is_not_turned_slides_just_where_the_margin_is_1(move: Move, tilt: float) -> None:
    wafer = replace(SLIPPERY, tilt=tilt)
    assert slip(wafer, planned(wafer, move, 1.005)) < STAYS
    assert slip(wafer, planned(wafer, move, 0.99)) > SLIDES


def test_a_move_planned_for_a_level_blade_loses_the_wafer_on_one_that_leans() -> None:
    path = planned(SLIPPERY, STRETCH_MOVES["level"], 1.2)
    assert slip(SLIPPERY, path) < STAYS
    leaning = replace(SLIPPERY, tilt=radians(2.0))
    assert slip_margin(leaning, blade_motion(ARM.geometry, path)).min() < 1.0
    assert slip(leaning, path) > SLIDES


MOVES = {
    "rotate, folded": synchronised((0.1, -1.0, 0.13), (0.1, 1.0, 0.13), ARM.limits),
    "rotate, stretched": synchronised((0.1, -1.0, 1.3), (0.1, 1.0, 1.3), ARM.limits),
    "all axes": synchronised((0.1, -1.0, 0.13), (0.3, 1.0, 1.3), ARM.limits),
}


@pytest.mark.parametrize("move", MOVES.values(), ids=MOVES.keys())
def test_a_wafer_that_is_turned_stays_while_its_worst_pad_holds_and_is_lost_soon_after(move: Move) -> None:
    """Pads that still hold help the worst one: where folded, the criterion is a quarter on the safe side."""
    assert slip(CERAMIC, planned(CERAMIC, move, 1.005)) < STAYS
    assert slip(CERAMIC, planned(CERAMIC, move, 0.75)) > SLIDES


def spun(rate: float) -> JointPath:
    """The wafer turned about its own centre, which no arm does: stretched so far back that the tool point is on the column."""
    stretch = asin(-ARM.geometry.blade / (2.0 * ARM.geometry.arm))
    spin = jerk_limited(0.0, 1.0, MotionLimits(10.0, rate, 20.0 * rate)).sample(PERIOD)
    columns = (spin.position, spin.velocity, spin.acceleration)
    still = np.zeros_like(spin.position)
    position, velocity, acceleration = (np.column_stack([still, column, still]) for column in columns)
    return JointPath(PERIOD, position + np.array([0.1, 0.0, stretch]), velocity, acceleration)


def test_a_wafer_that_is_only_turned_slips_where_its_moment_of_inertia_says() -> None:
    """m R²/2 w' = mu m g Rp."""
    limit = 2.0 * CERAMIC.friction * GRAVITY * CERAMIC.pad_radius / CERAMIC.radius**2
    assert slip_margin(CERAMIC, blade_motion(ARM.geometry, spun(limit))).min() == pytest.approx(1.0, rel=1e-9)
    assert slip(CERAMIC, spun(limit / 1.005)) < STAYS
    assert slip(CERAMIC, spun(limit / 0.99)) > SLIDES


def test_limits_of_a_carried_turn_take_all_friction_each_for_itself() -> None:
    reach = 2.0 * 0.20 * np.sin(0.13) + 0.24
    limits = turn_limits(ARM.limits[1], CERAMIC, reach, 1.5)
    pose, none = np.array([[0.1, 0.4, 0.13]] * 2), np.zeros(2)
    speed = np.column_stack([none, [limits.speed, 0.0], none])
    acceleration = np.column_stack([none, [0.0, limits.acceleration], none])
    margin = slip_margin(CERAMIC, blade_motion(ARM.geometry, JointPath(PERIOD, pose, speed, acceleration)))
    np.testing.assert_allclose(margin, [1.5, 1.5], rtol=1e-12)
    assert limits.acceleration / limits.jerk == pytest.approx(ARM.limits[1].acceleration / ARM.limits[1].jerk)
    wide = MotionLimits(0.1, 0.1, 1.0)
    assert turn_limits(wide, CERAMIC, reach, 1.5) == wide


@given(tilt=st.floats(0.0, 0.19), up=st.floats(-5.0, 5.0))
@settings(max_examples=100, deadline=None)
def test_a_leaning_blade_is_a_level_one_with_less_friction(tilt: float, up: float) -> None:
    """By the forces on a mass on a slope, per mass: along it a cos b + (g + a_z) sin b, across it (g + a_z) cos b - a sin b."""
    wafer = Wafer(friction=0.2, tilt=tilt)
    weight = GRAVITY + up
    most = wafer.level_friction * weight
    along, across = most * cos(tilt) + weight * sin(tilt), weight * cos(tilt) - most * sin(tilt)
    assert along == pytest.approx(0.2 * across, rel=1e-12)


def test_at_rest_nothing_slips_and_in_free_fall_nothing_holds() -> None:
    rest, fall = np.zeros((1, 3)), np.array([[-GRAVITY, 0.0, 0.0]])
    pose = np.array([[0.1, 0.0, 0.5]])
    assert slip_margin(CERAMIC, blade_motion(ARM.geometry, JointPath(PERIOD, pose, rest, rest))).tolist() == [np.inf]
    assert slip_margin(CERAMIC, blade_motion(ARM.geometry, JointPath(PERIOD, pose, rest, fall))).tolist() == [0.0]


def test_a_move_that_holds_the_wafer_keeps_its_time() -> None:
    gentle = MOVES["rotate, folded"].scaled_to(10.0)
    assert slowed(gentle, PERIOD, lambda path: wafer_stretch(CERAMIC, ARM.geometry, path, 1.5)) is gentle


def test_blades_that_hold_no_wafer_are_refused() -> None:
    with pytest.raises(UserError, match=r"tilted by 12 deg does not hold .* of 0.2: it slides from 11.3 deg on"):
        Wafer(friction=0.2, tilt=radians(12.0))
    with pytest.raises(UserError, match="three pads or more; this blade has 2"):
        Wafer(pads=2)
