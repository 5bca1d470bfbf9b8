"""A wafer's transfer as the plant would do it: joined, straight, and the wafer arrives without having slipped."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from plant_tool import plant_tool
from wafer_bench import slip
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.transfer import Handler, Phase, Segment, Station
from wafer_handler.scara.wafer import Wafer, blade_motion, slip_margin

from drivetwin.foundation.errors import UserError
from drivetwin.motion.jerk_limited import MotionLimits, jerk_limited

PERIOD = 0.0005
ULPS = 1.0 + 1e-12
HANDLER = Handler(
    arm=load_arm(),
    wafer=Wafer(tilt=radians(1.0)),
    line=MotionLimits(1.0, 5.0, 100.0),
    clearance=0.010,
    safety=1.5,
    period=PERIOD,
)
SOURCE, TARGET = Station(angle=-1.0, reach=0.60, height=0.80), Station(angle=1.2, reach=0.55, height=0.90)


@pytest.fixture(scope="module")
def segments() -> tuple[Segment, ...]:
    return HANDLER.transfer(SOURCE, TARGET)


def test_a_transfer_has_its_phases_in_order_and_the_wafer_on_from_pick_to_place(segments: tuple[Segment, ...]) -> None:
    assert [segment.phase for segment in segments] == list(Phase)
    assert [segment.loaded for segment in segments] == [False, True, True, True, True, True, False]


def test_each_move_starts_where_the_last_one_ended(segments: tuple[Segment, ...]) -> None:
    position = np.vstack([segment.path.position for segment in segments])
    fastest = np.array([limits.speed for limits in HANDLER.arm.limits])
    assert np.all(np.abs(np.diff(position, axis=0)) <= fastest * PERIOD * ULPS + 1e-15)
    for segment in segments:
        np.testing.assert_allclose(segment.path.velocity[-1], 0.0, atol=1e-12)
        for axis, limits in enumerate(HANDLER.arm.limits):
            assert np.abs(segment.path.velocity[:, axis]).max() <= limits.speed * ULPS
            assert np.abs(segment.path.acceleration[:, axis]).max() <= limits.acceleration * ULPS


def test_the_plants_tool_is_under_over_and_before_the_stations_when_it_should(segments: tuple[Segment, ...]) -> None:
    ends = [plant_tool(segment.path).position[-1] for segment in segments]
    low, high = -0.010, 0.010
    folded = 2.0 * 0.20 * np.sin(0.13) + 0.24
    expected = [
        (SOURCE, SOURCE.reach, 0.0),
        (SOURCE, SOURCE.reach, high),
        (SOURCE, folded, high),
        (TARGET, folded, high),
        (TARGET, TARGET.reach, high),
        (TARGET, TARGET.reach, 0.0),
        (TARGET, folded, low),
    ]
    for end, (station, reach, above) in zip(ends, expected, strict=True):
        point = [-reach * np.sin(station.angle), reach * np.cos(station.angle), station.height + above]
        np.testing.assert_allclose(end, point, atol=1e-12)


def test_the_blade_goes_in_below_the_wafer_and_comes_out_below_it(segments: tuple[Segment, ...]) -> None:
    for segment, station in ((segments[0], SOURCE), (segments[-1], TARGET)):
        x, y, z = plant_tool(segment.path).position.T
        inside = np.abs(np.hypot(x, y) - station.reach) > 1e-9
        assert inside.sum() > 100
        np.testing.assert_allclose(z[inside], station.height - 0.010, atol=1e-9)


def test_blade_moves_stay_on_the_stations_ray(segments: tuple[Segment, ...]) -> None:
    for segment, station in zip(segments, [SOURCE] * 3 + [None] + [TARGET] * 3, strict=True):
        if station is not None:
            x, y, _ = plant_tool(segment.path).position.T
            assert np.abs(x * np.cos(station.angle) + y * np.sin(station.angle)).max() < 1e-9


def test_no_loaded_move_uses_more_friction_than_it_may_and_none_lets_the_wafer_slip(segments: tuple[Segment, ...]) -> None:
    for segment in segments:
        if segment.loaded:
            margin = slip_margin(HANDLER.wafer, blade_motion(HANDLER.arm.geometry, segment.path))
            assert margin.min() >= HANDLER.safety * (1.0 - 1e-12)
            assert slip(HANDLER.wafer, segment.path) < 1e-6


def test_without_the_wafer_the_same_way_is_quicker_and_would_lose_it(segments: tuple[Segment, ...]) -> None:
    withdraw, extend = segments[-1], segments[-3]
    assert len(withdraw.path.position) < len(extend.path.position)
    approach = segments[0]
    assert slip_margin(HANDLER.wafer, blade_motion(HANDLER.arm.geometry, approach.path)).min() < 1.0
    assert slip(HANDLER.wafer, approach.path) > 1e-3


def test_a_carried_stretch_move_is_slow_by_its_acceleration_only(segments: tuple[Segment, ...]) -> None:
    """The seven segments of speed 1 m/s, acceleration mu g / 1.5 and a jerk that reaches it in as long as the empty blade's."""
    acceleration = np.tan(np.arctan(0.2) - radians(1.0)) * 9.81 / 1.5
    way = SOURCE.reach - (2.0 * 0.20 * np.sin(0.13) + 0.24)
    alone = jerk_limited(0.0, way, MotionLimits(1.0, acceleration, acceleration * 100.0 / 5.0))
    assert len(segments[2].path.position) == pytest.approx(alone.duration / PERIOD, abs=1.0)


def test_a_carried_turn_is_no_slower_than_its_centripetal_and_its_tangential_acceleration_ask(
    segments: tuple[Segment, ...],
) -> None:
    """Each alone is a lower bound of the time; both come together at the end of a ramp, which costs less than a fifth."""
    most = np.tan(np.arctan(0.2) - radians(1.0)) * 9.81 / 1.5
    reach = 2.0 * 0.20 * np.sin(0.13) + 0.24
    acceleration = most / (reach + 0.150**2 / (2.0 * 0.100))
    alone = jerk_limited(SOURCE.angle, TARGET.angle, MotionLimits(np.sqrt(most / reach), acceleration, 20.0 * acceleration))
    assert 1.0 <= len(segments[3].path.position) * PERIOD / alone.duration < 1.2


def test_moves_that_friction_limits_use_all_that_they_may(segments: tuple[Segment, ...]) -> None:
    for segment in segments:
        if segment.phase in (Phase.RETRACT, Phase.ROTATE, Phase.EXTEND):
            margin = slip_margin(HANDLER.wafer, blade_motion(HANDLER.arm.geometry, segment.path))
            assert margin.min() == pytest.approx(1.5, rel=2e-3)


def test_a_station_out_of_reach_is_refused_with_where_the_line_ends() -> None:
    far = replace(TARGET, reach=0.65)
    with pytest.raises(UserError, match=r"leaves the workspace 0.3581 m after its start: .* too far: it lies 0.65 m"):
        HANDLER.transfer(SOURCE, far)
