"""Bits 12 and 13 of the statusword in every mode, by the tables of the modes' clauses in CiA 402-2."""

from __future__ import annotations

import pytest
from drive_bench import ENABLE, HALT, QUICK_STOP, START, DriveBench

POSITION, VELOCITY, PROFILE_VELOCITY, TORQUE, HOMING, INTERPOLATED, CYCLIC, CYCLIC_VELOCITY, CYCLIC_TORQUE = (
    *(1, 2, 3, 4, 6, 7, 8, 9, 10),
)
BIT_12, BIT_13 = 1 << 12, 1 << 13


def bits(bench: DriveBench) -> int:
    return int(bench.read(0x6041)) & (BIT_12 | BIT_13)


def enabled(mode: int) -> DriveBench:
    bench = DriveBench("scara", "rotate")
    bench.sync(5)
    bench.write(0x607A, bench.read(0x6064))
    bench.enable(mode)
    bench.sync(20)
    return bench


@pytest.mark.parametrize(
    ("mode", "expected"),
    [
        (POSITION, 0),  # set-point acknowledge, following error
        (VELOCITY, 0),  # reserved
        (PROFILE_VELOCITY, BIT_12),  # speed is 0, max. slippage error (of asynchronous motors)
        (TORQUE, 0),  # reserved
        (HOMING, 0),  # homing attained, homing error
        (INTERPOLATED, 0),  # ip mode active, reserved
        (CYCLIC, BIT_12),  # drive follows the command value, following error
        (CYCLIC_VELOCITY, BIT_12),  # drive follows the command value, reserved
        (CYCLIC_TORQUE, BIT_12),  # drive follows the command value, reserved
    ],
)
def test_bits_of_an_axis_that_stands_enabled(mode: int, expected: int) -> None:
    assert bits(enabled(mode)) == expected


@pytest.mark.parametrize(("mode", "expected"), [(POSITION, BIT_12), (INTERPOLATED, BIT_12)])
def test_bit_12_answers_bit_4(mode: int, expected: int) -> None:
    """Mode 1: set-point acknowledge; mode 7: ip mode active."""
    bench = enabled(mode)
    bench.command(START)
    assert bits(bench) == expected
    bench.command(ENABLE)
    assert bits(bench) == 0


@pytest.mark.parametrize("mode", [CYCLIC, CYCLIC_VELOCITY, CYCLIC_TORQUE])
@pytest.mark.parametrize("controlword", [HALT, QUICK_STOP])
def test_a_drive_that_stops_does_not_follow_the_command(mode: int, controlword: int) -> None:
    bench = enabled(mode)
    bench.write(0x605A, 6)
    bench.command(controlword)
    assert bits(bench) == 0


@pytest.mark.parametrize(
    ("mode", "target", "within", "beyond"),
    [(CYCLIC, 0x607A, 0.2, 3.0), (CYCLIC_VELOCITY, 0x60FF, 5.0, 30.0), (CYCLIC_TORQUE, 0x6071, 100, 600)],
)
def test_a_command_beyond_a_limit_is_not_followed(mode: int, target: int, within: float, beyond: float) -> None:
    """607Dh = 1 rad, 607Fh = 20 rad/s, 6072h = 500: bit 12 falls, bit 11 rises."""
    bench = enabled(mode)
    bench.write(0x607D, bench.units(-100.0), 1)
    bench.write(0x607D, bench.units(1.0), 2)
    bench.write(0x607F, bench.units(20.0))
    bench.write(0x6072, 500)
    for value, follows in ((within, True), (beyond, False), (within, True)):
        bench.write(target, value if mode == CYCLIC_TORQUE else bench.units(value))
        bench.sync()
        assert bool(bits(bench) & BIT_12) is follows
        assert follows or int(bench.read(0x6041)) & 1 << 11


def lag(bench: DriveBench) -> None:
    """No torque, and a target far away: beyond 6065h for longer than 6066h."""
    bench.write(0x6065, bench.units(0.1))
    bench.write(0x6066, 10)
    bench.write(0x6072, 0)
    bench.write(0x6081, bench.units(100.0))
    target = int(bench.read(0x6064)) + bench.units(5.0)
    bench.write(0x607A, target)
    bench.write(0x60C1, target, 1)
    bench.command(START)


@pytest.mark.parametrize(("mode", "expected"), [(POSITION, BIT_13), (CYCLIC, BIT_13), (INTERPOLATED, 0)])
def test_following_error_bit(mode: int, expected: int) -> None:
    """Modes 1 and 8: set once the time-out has passed, until the fault is reset. It is reserved in mode 7."""
    bench = enabled(mode)
    lag(bench)
    bench.sync(5)
    assert not bits(bench) & BIT_13
    bench.sync(60)
    assert bench.emergencies() == [0x8611]
    assert bits(bench) == expected
    bench.command(0x00, 0x80)
    assert bits(bench) == 0
