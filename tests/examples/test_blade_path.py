"""Blade lines against the plant's own kinematics (MuJoCo, with its belts): straight, as planned, within limits, or refused."""

from __future__ import annotations

from math import atan2, hypot, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_tool import plant_tool
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.blade_path import Point, blade_line, distance_from_line
from wafer_handler.scara.kinematics import forward

from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

PERIOD = 0.004
ARM = load_arm()
LIMITS = MotionLimits(1.0, 5.0, 100.0)
ULPS = 1.0 + 1e-12

angles = st.floats(-2.7, 2.7)
reaches = st.floats(0.30, 0.63)
heights = st.floats(0.71, 1.02)


def at(angle: float, reach: float, height: float) -> Point:
    """The tool point with the blade turned by `angle`: theta2 counts from the y axis."""
    return Point(-reach * np.sin(angle), reach * np.cos(angle), height)


def coordinates(point: Point) -> np.ndarray:
    return np.array([point.x, point.y, point.z])


@given(angle=angles, turned=st.floats(-0.45, 0.45), start=reaches, end=reaches, low=heights, high=heights)
@settings(max_examples=25, deadline=None)
def test_the_plants_tool_goes_straight_and_as_planned(
    angle: float, turned: float, start: float, end: float, low: float, high: float
) -> None:
    first, last = at(angle, start, low), at(float(np.clip(angle + turned, -2.7, 2.7)), end, high)
    line = blade_line(ARM, first, last, LIMITS, PERIOD)
    path, way = line.sample(PERIOD), line.way.sample(PERIOD)
    if not len(path.position):
        return
    tool = plant_tool(path)
    direction = (coordinates(last) - coordinates(first)) / line.way.end
    np.testing.assert_allclose(tool.position, coordinates(first) + np.outer(way.position, direction), atol=1e-12)
    np.testing.assert_allclose(tool.velocity, np.outer(way.velocity, direction), atol=1e-12)
    np.testing.assert_allclose(tool.acceleration, np.outer(way.acceleration, direction), atol=1e-10)
    outward = np.arctan2(tool.position[:, 1], tool.position[:, 0])
    np.testing.assert_allclose((tool.yaw - outward + pi) % (2.0 * pi) - pi, 0.0, atol=1e-12)
    np.testing.assert_allclose(tool.position[-1], coordinates(last), atol=1e-12)
    for axis, limits in enumerate(ARM.limits):
        assert np.abs(path.velocity[:, axis]).max() <= limits.speed * ULPS
        assert np.abs(path.acceleration[:, axis]).max() <= limits.acceleration * ULPS


def test_a_stretch_move_turns_nothing_and_is_straight() -> None:
    line = blade_line(ARM, at(0.4, 0.30, 0.85), at(0.4, 0.62, 0.85), LIMITS, 0.001)
    path = line.sample(0.001)
    np.testing.assert_allclose(path.position[:, 1], 0.4, atol=1e-15)
    np.testing.assert_allclose(path.velocity[:, 1], 0.0, atol=1e-14)
    reach = 2.0 * 0.20 * np.sin(path.position[:, 2]) + 0.24  # L3, L5 of the paper's chain
    np.testing.assert_allclose(reach, 0.30 + line.way.sample(0.001).position, atol=1e-12)
    # straightness: how far the plant's tool leaves the ray it moves on
    x, y, _ = plant_tool(path).position.T
    assert np.abs(x * np.cos(0.4) + y * np.sin(0.4)).max() < 1e-9
    assert distance_from_line(line.start, line.end, tool_points(path.position)).max() < 1e-9


def tool_points(joints: np.ndarray) -> np.ndarray:
    pose = forward(ARM.geometry, joints)
    return np.column_stack([pose.x, pose.y, pose.z])


def test_straightness_is_the_distance_of_the_tool_from_the_line() -> None:
    start, end = at(0.4, 0.30, 0.85), at(0.4, 0.62, 0.85)
    path = blade_line(ARM, start, end, LIMITS, 0.001).sample(0.001)
    reach = 2.0 * 0.20 * np.sin(path.position[:, 2]) + 0.24
    turned = path.position + np.array([0.0, 1e-4, 0.0])
    np.testing.assert_allclose(distance_from_line(start, end, tool_points(turned)), reach * np.sin(1e-4), rtol=1e-9)
    lifted = turned + np.array([3e-5, 0.0, 0.0])
    expected = np.hypot(reach * np.sin(1e-4), 3e-5)
    np.testing.assert_allclose(distance_from_line(start, end, tool_points(lifted)), expected, rtol=1e-9)
    with pytest.raises(UserError, match="two points make a line; start and end are both at"):
        distance_from_line(start, start, tool_points(path.position))


def test_a_line_without_a_length_is_no_motion() -> None:
    line = blade_line(ARM, at(0.4, 0.5, 0.85), at(0.4, 0.5, 0.85), LIMITS, PERIOD)
    assert line.duration == 0.0
    assert line.sample(PERIOD).position.shape == (0, 3)


def test_where_only_the_line_is_limited_it_takes_the_time_of_its_own_profile() -> None:
    slow = MotionLimits(0.1, 1.0, 20.0)
    line = blade_line(ARM, at(0.0, 0.35, 0.8), at(0.0, 0.55, 0.8), slow, PERIOD)
    assert line.duration == pytest.approx(jerk_limited(0.0, 0.2, slow).duration, rel=1e-12)


def test_where_an_axis_is_limited_the_line_gets_slower_just_so_far() -> None:
    line = blade_line(ARM, Point(-0.3, 0.3, 0.85), Point(0.3, 0.32, 0.85), MotionLimits(5.0, 100.0, 5000.0), 0.001)
    path = line.sample(0.001)
    used = [
        max(
            np.abs(path.velocity[:, axis]).max() / limits.speed,
            sqrt(np.abs(path.acceleration[:, axis]).max() / limits.acceleration),
        )
        for axis, limits in enumerate(ARM.limits)
    ]
    assert 0.99 < max(used) <= ULPS


def test_a_line_behind_the_column_keeps_its_angle_continuous() -> None:
    line = blade_line(ARM, at(2.2, 0.6, 0.8), at(2.75, 0.5, 0.8), LIMITS, PERIOD)
    rotate = line.sample(PERIOD).position[:, 1]
    assert np.abs(np.diff(rotate)).max() < 2.5 * PERIOD * ULPS
    assert rotate[-1] == pytest.approx(2.75, abs=1e-12)


@pytest.mark.parametrize(
    ("start", "end", "reason"),
    [
        (
            Point(0.0, 0.32, 0.8),
            Point(0.0, 0.66, 0.8),
            r"0.34 m after its start: the pose \(0, 0.66, 0.8\) .* too far: it lies 0.66 m .* the blade reaches 0.631963 m",
        ),
        (
            Point(-0.3, 0.1, 0.8),
            Point(0.3, 0.1, 0.8),
            r"0.3 m after its start: the pose \(0, 0.1, 0.8\) .* too near: it lies 0.1 m .* folded arm reaches 0.291854 m",
        ),
        (
            Point(0.0, 0.4, 0.8),
            Point(0.0, 0.4, 1.05),
            r"0.25 m after its start: .* lift would stand at 0.36 m, its travel is 0.01 .. 0.34 m",
        ),
        (
            at(0.5, 0.64, 0.8),
            at(0.5, 0.40, 0.8),
            r"leaves the workspace 0 m after its start: .* too far: it lies 0.64 m from the column",
        ),
        (
            at(-2.7, 0.6, 0.8),
            at(2.3, 0.33, 0.8),
            r"0.3047 m after its start: .* rotate would stand at -?3.14159 rad, its travel is -2.8 .. 2.8 rad",
        ),
    ],
    ids=["too far", "through the column", "too high", "from outside", "round the back"],
)
def test_a_line_that_leaves_the_workspace_is_refused_with_where_and_by_how_much(start: Point, end: Point, reason: str) -> None:
    with pytest.raises(UserError, match=reason):
        blade_line(ARM, start, end, LIMITS, PERIOD)


@given(angle=angles, turned=st.floats(-2.0, 2.0), start=reaches, end=reaches)
@settings(max_examples=60, deadline=None)
def test_a_line_is_refused_exactly_where_a_point_of_it_is_out_of_reach(
    angle: float, turned: float, start: float, end: float
) -> None:
    first, last = at(angle, start, 0.8), at(float(np.clip(angle + turned, -2.7, 2.7)), end, 0.8)
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    points = (1.0 - share) * coordinates(first) + share * coordinates(last)
    nearest = min(hypot(x, y) for x, y, _ in points)
    behind = any(abs(atan2(-x, y)) > 2.8 for x, y, _ in points)
    least = 2.0 * 0.20 * np.sin(0.13) + 0.24
    if abs(nearest - least) < 1e-4:  # between two of these points
        return
    if nearest < least or behind:
        with pytest.raises(UserError, match="leaves the workspace"):
            blade_line(ARM, first, last, LIMITS, PERIOD)
    else:
        assert blade_line(ARM, first, last, LIMITS, PERIOD).way.end == pytest.approx(
            float(np.linalg.norm(coordinates(last) - coordinates(first)))
        )
