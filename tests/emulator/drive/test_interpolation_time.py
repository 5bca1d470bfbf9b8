"""CiA 402-2, 'Object 60C2h: Interpolation time period': the time between two set-points, over which the drive interpolates."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLIC, INTERPOLATED, START, DriveBench

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort

SPEED = 2.0
"""Turns a second."""

STREAMS = [("cia402-full", CYCLIC), ("cia402-full", INTERPOLATED), ("servoone", INTERPOLATED), ("dryve_d1", CYCLIC)]


def stream(bench: DriveBench, mode: int, every: int, set_points: int) -> tuple[np.ndarray, np.ndarray]:
    """A set-point at every so many SYNCs, two turns a second: of its second half demanded speed [turns/s], torque [1/1000]."""
    place = (0x60C1, 1) if mode == INTERPOLATED else (0x607A, 0)
    bench.enable(mode)
    bench.command(START)
    position = bench.read(0x6064)
    speeds: list[float] = []
    torques: list[float] = []
    for number in range(set_points):
        position += round(SPEED * bench.units(2.0 * pi) * every * 0.001)
        bench.write(place[0], position, place[1])
        for _ in range(every):
            bench.sync()
            if number >= set_points // 2:
                speeds.extend(bench.drive.axis.servo.demand[:, 1] / (2.0 * pi))
                torques.append(float(bench.drive.axis.servo.state["torque_demand"]) / 0.4 * 1000.0)
    return np.array(speeds), np.array(torques)


@pytest.mark.parametrize(("profile", "mode"), STREAMS)
@pytest.mark.parametrize(("value", "index", "cycles"), [(1, -3, 1), (10, -3, 10), (1, -2, 10), (200, -4, 20), (7, -3, 7)])
def test_the_axis_goes_evenly_from_set_point_to_set_point(profile: str, mode: int, value: int, index: int, cycles: int) -> None:
    """60C2h as long as the set-points are apart: the speed is that of the set-points in every servo period."""
    bench = DriveBench("scara", "rotate", profile, effects=())
    bench.write(0x60C2, value, 1)
    bench.write(0x60C2, index, 2)
    speeds, torques = stream(bench, mode, cycles, 80)
    assert speeds == pytest.approx(SPEED, rel=1e-3)
    assert np.abs(torques).max() < 30


def test_without_it_the_axis_goes_in_steps() -> None:
    """60C2h = 1 ms, a set-point every 10 ms: what a master gets that does not say what it does."""
    bench = DriveBench("scara", "rotate", effects=())
    speeds, _ = stream(bench, CYCLIC, 10, 80)
    assert speeds.max() == pytest.approx(10.0 * SPEED, rel=1e-3)
    assert speeds.min() == 0.0


@pytest.mark.parametrize(("profile", "mode"), STREAMS)
def test_the_end_of_a_stream_is_its_last_set_point(profile: str, mode: int) -> None:
    bench = DriveBench("scara", "rotate", profile, effects=())
    bench.write(0x60C2, 10, 1)
    stream(bench, mode, 10, 20)
    bench.sync(400)
    place = (0x60C1, 1) if mode == INTERPOLATED else (0x607A, 0)
    last = float(bench.drive.dictionary[place].number)
    assert bench.drive.axis.scaling.position(float(bench.drive.axis.servo.demand[-1, 0])) == pytest.approx(last, abs=2)


def test_a_longer_1006h_goes_before() -> None:
    """SYNC every 10 ms and 60C2h at its 1 ms: a set-point a SYNC is a straight line over 10 ms."""
    bench = DriveBench("scara", "rotate", effects=())
    bench.write(0x1006, 10_000)
    bench.enable(CYCLIC)
    position = bench.read(0x6064)
    for _ in range(10):
        position += round(SPEED * bench.units(2.0 * pi) * 0.01)
        bench.write(0x607A, position)
        bench.sync()
    assert bench.drive.axis.servo.demand[:, 1] / (2.0 * pi) == pytest.approx(SPEED, rel=1e-3)


@pytest.mark.parametrize("profile", ["cia402-full", "servoone", "dryve_d1"])
@pytest.mark.parametrize(
    ("cycle", "value", "index", "code"),
    [
        (0, 15, -4, AbortCode.INVALID_VALUE),
        (2000, 1, -3, AbortCode.INVALID_VALUE),
        (2000, 3, -3, AbortCode.INVALID_VALUE),
        (0, 20, 0, AbortCode.INVALID_VALUE),
        (0, 1, 1, AbortCode.VALUE_TOO_HIGH),
        (0, 1, 63, AbortCode.VALUE_TOO_HIGH),
        (0, 1, -7, AbortCode.VALUE_TOO_LOW),
        (0, 1, -128, AbortCode.VALUE_TOO_LOW),
        (0, 0, -3, AbortCode.VALUE_TOO_LOW),
    ],
)
def test_what_is_no_whole_cycles_is_refused(profile: str, cycle: int, value: int, index: int, code: AbortCode) -> None:
    bench = DriveBench("scara", "rotate", profile)
    bench.write(0x60C2, 10, 1)
    bench.write(0x1006, cycle)
    with pytest.raises(SdoAbort) as refused:  # noqa: PT012  # either of the two writes may be the one
        bench.write(0x60C2, index, 2)
        bench.write(0x60C2, value, 1)
    assert refused.value.code == code


WHOLE = [(2000, 2, -3), (250, 250, -6), (250, 1, -3), (0, 255, -3), (20_000, 2, -2)]


@pytest.mark.parametrize(("cycle", "value", "index"), WHOLE)
def test_whole_cycles_are_taken(cycle: int, value: int, index: int) -> None:
    bench = DriveBench("scara", "rotate")
    bench.write(0x1006, cycle)
    bench.write(0x60C2, index, 2)
    bench.write(0x60C2, value, 1)
    assert (bench.read(0x60C2, 1), bench.read(0x60C2, 2)) == (value, index)


def test_as_ros2_canopen_configures_it() -> None:
    """bus.yml of its examples: 60C2h:01 = 50, then 60C2h:02 = -3, 1006h untouched."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x60C2, 50, 1)
    bench.write(0x60C2, -3, 2)
    assert bench.drive.axis.set_point_interval == 400
