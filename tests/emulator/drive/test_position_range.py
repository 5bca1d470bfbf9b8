"""CiA 402-2: position range limit 607Bh and the rotary options of 60F2h; a table, 1:200 on the joint, has 3600 units a turn."""

from __future__ import annotations

from math import pi

import pytest
from drive_bench import CYCLIC, ENABLE, INTERPOLATED, START, DriveBench

POSITION = 1
NEW, RELATIVE = 0x10, 0x40
NEGATIVE, POSITIVE, SHORTEST = 1 << 6, 2 << 6, 3 << 6
"""Bits 6 and 7 of 60F2h."""
TURN, GEAR = 3600, 200


def rotary(mode: int, low: int = 0, high: int = TURN) -> DriveBench:
    bench = DriveBench("scara", "rotate")
    for index, value in ((0x6091, 50), (0x6092, GEAR * TURN)):
        bench.write(index, value, 1)
        bench.write(index, 1, 2)
    bench.write(0x607B, low, 1)
    bench.write(0x607B, high, 2)
    bench.write(0x6081, 9000)
    bench.write(0x6083, 200_000)
    bench.write(0x6084, 200_000)
    bench.sync()
    if mode == CYCLIC:
        bench.write(0x607A, bench.read(0x6064))
    bench.enable(mode)
    bench.sync(20)
    return bench


def turned(bench: DriveBench, start: float) -> float:
    """Units that the table has turned, counting turns."""
    return (bench.joint - start) / (2.0 * pi) * GEAR * TURN


def move(bench: DriveBench, target: int, bits: int = 0) -> float:
    """Units turned by a move in mode 1."""
    start = bench.joint
    bench.write(0x607A, target)
    bench.command(ENABLE, ENABLE | NEW | bits, ENABLE)
    bench.sync(1200)
    return turned(bench, start)


def at(bench: DriveBench, position: int) -> DriveBench:
    """Brought to a position, so that the drive is in the middle of nothing."""
    bench.write(0x60F2, SHORTEST)
    move(bench, position)
    assert bench.read(0x6064) == pytest.approx(position, abs=1)
    return bench


@pytest.mark.parametrize(("low", "high"), [(0, TURN), (-1800, 1800), (100, 1000)])
def test_positions_wrap_at_the_ends_of_the_range(low: int, high: int) -> None:
    """6064h and 6062h go from the upper end to the lower, and stay within; the joint turns on."""
    bench = rotary(POSITION, low, high)
    start, before = bench.joint, bench.read(0x6064)
    bench.write(0x607A, 5000)
    bench.command(ENABLE, ENABLE | NEW | RELATIVE, ENABLE)
    rows = bench.record(1200, 0x6064, 0x6062)
    assert rows.min() >= low
    assert rows.max() < high
    assert turned(bench, start) == pytest.approx(5000.0, abs=2.0)
    assert rows[-1, 0] == pytest.approx(low + (before + 5000 - low) % (high - low), abs=1)


@pytest.mark.parametrize(
    ("option", "target", "way"),
    [  # from 3500
        (0, 100, -3400),
        (POSITIVE, 100, 200),
        (NEGATIVE, 100, -3400),
        (SHORTEST, 100, 200),
        (0, 3400, -100),
        (POSITIVE, 3400, 3500),
        (NEGATIVE, 3400, -100),
        (SHORTEST, 3400, -100),
        (SHORTEST, 1700, 1800),  # a tie is positive
        (SHORTEST, 1699, 1799),
        (SHORTEST, 1701, -1799),
        (0, TURN + 100, -3400),  # the input value wraps
        (POSITIVE, 3500, 0),
        (NEGATIVE, 3500, 0),
    ],
)
def test_the_way_to_a_target_is_by_the_rotary_option(option: int, target: int, way: int) -> None:
    bench = at(rotary(POSITION), 3500)
    bench.write(0x60F2, option)
    assert move(bench, target) == pytest.approx(way, abs=2.0)
    assert bench.read(0x6064) == pytest.approx(target % TURN, abs=1)


@pytest.mark.parametrize("option", [POSITIVE, NEGATIVE])
def test_directions_are_those_of_user_units(option: int) -> None:
    """With 607Eh bit 7 the joint turns the other way."""
    bench = rotary(POSITION)
    bench.write(0x607E, 0x80)
    at(bench, 1000)
    bench.write(0x60F2, option)
    assert move(bench, 1500) == pytest.approx(-500.0 if option == POSITIVE else 3100.0, abs=2.0)


def test_a_set_point_that_waits_departs_from_the_present_target() -> None:
    """Both by the positive direction: 500, then 400 a turn further on."""
    bench = at(rotary(POSITION), 3500)
    start = bench.joint
    bench.write(0x60F2, POSITIVE)
    for target in (500, 400):
        bench.write(0x607A, target)
        bench.command(ENABLE, ENABLE | NEW, ENABLE)
    bench.sync(2000)
    assert turned(bench, start) == pytest.approx(600.0 + 3500.0, abs=3.0)


@pytest.mark.parametrize(("mode", "index", "sub"), [(CYCLIC, 0x607A, 0), (INTERPOLATED, 0x60C1, 1)])
def test_streamed_set_points_go_on_over_the_end(mode: int, index: int, sub: int) -> None:
    """Two turns and a half, as a master counts that knows of one turn only."""
    bench = rotary(mode)
    start, before = bench.joint, int(bench.read(0x6064))
    bench.write(index, before, sub)
    bench.command(START)
    for step in range(1, 901):
        bench.write(index, (before + 10 * step) % TURN, sub)
        bench.sync()
    bench.sync(400)
    assert turned(bench, start) == pytest.approx(9000.0, abs=2.0)
    assert bench.read(0x6064) == pytest.approx((before + 9000) % TURN, abs=1)


@pytest.mark.parametrize(("low", "high"), [(0, 0), (-(1 << 31), (1 << 31) - 1), (TURN, 0)])
def test_a_range_that_is_none(low: int, high: int) -> None:
    bench = rotary(POSITION, low, high)
    before = bench.read(0x6064)
    assert move(bench, int(before) + 5000) == pytest.approx(5000.0, abs=2.0)
    assert bench.read(0x6064) == pytest.approx(before + 5000, abs=1)
