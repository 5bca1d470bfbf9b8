"""Homing methods 1..14, 17..30, 33, 34 from every side of the switch: each ends where the figure of CiA 402-2 has it."""

from __future__ import annotations

from math import ceil, floor, inf, pi

import pytest
from drive_bench import HOMING, START, DriveBench

from drivetwin.emulator.drive.hardware import NEVER, Switch
from drivetwin.emulator.drive.homing_methods import METHODS
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.machine import Machine, load_machine

FAST, SLOW = 120.0, 12.0
INDEX_ANGLE = 1.0
ATTAINED, ERROR, REACHED = 1 << 12, 1 << 13, 1 << 10

FIGURES = {
    # method: (edge, side of the edge on which the index pulse is)
    1: ("negative limit", 1),
    2: ("positive limit", -1),
    3: ("left", -1),
    4: ("left", 1),
    5: ("right", 1),
    6: ("right", -1),
    7: ("left", -1),
    8: ("left", 1),
    9: ("right", -1),
    10: ("right", 1),
    11: ("right", 1),
    12: ("right", -1),
    13: ("left", 1),
    14: ("left", -1),
}
"""Read off the figures, not from the code; methods 17 to 30 have the edge itself."""

STARTS = {"left": -0.06, "on": 0.0, "right": 0.06}
"""Joint positions [m] beside and on the home switch of the stage, -0.02..0.02 m."""


def placed(machine: Machine, start: float) -> Machine:
    axes = {name: axis.model_copy(update={"power_on_position": start}) for name, axis in machine.axes.items()}
    return machine.model_copy(update={"axes": axes})


def bench_for(method: int, start: float) -> DriveBench:
    bench = DriveBench(placed(load_machine("stage"), start))
    hardware = bench.drive.hardware
    hardware.index_angle = INDEX_ANGLE
    home = hardware.home_switch
    assert home is not None
    kind = method if method <= 14 else method - 16
    if kind in (3, 4):  # the switch of these figures reaches to the positive end
        hardware.home_switch = Switch(home.low, inf)
    if kind in (5, 6):
        hardware.home_switch = Switch(-inf, home.high)
    bench.write(0x6098, method)
    bench.write(0x6099, bench.units(FAST), 1)
    bench.write(0x6099, bench.units(SLOW), 2)
    bench.write(0x609A, bench.units(4000.0))
    bench.enable(HOMING)
    return bench


def run(bench: DriveBench, limit: int = 12_000) -> int:
    """Bits 12 and 13 at the end."""
    bench.write(0x6040, START)
    for _ in range(limit):
        bench.sync()
        bits = int(bench.read(0x6041)) & (ATTAINED | ERROR | REACHED)
        if bits in (ATTAINED | REACHED, ERROR | REACHED):
            return bits & ~REACHED
    raise AssertionError("homing did not end")


def expected(bench: DriveBench, method: int) -> tuple[float, int]:
    """Home position [rad] of the figure, and the direction in which it is crossed."""
    home, limits = bench.drive.hardware.home_switch, bench.drive.hardware.switches
    assert home is not None
    name, side = FIGURES[method if method <= 14 else method - 16]
    edge = {"negative limit": limits.low, "positive limit": limits.high, "left": home.low, "right": home.high}[name]
    if method > 14:
        return edge, side
    turns = (edge - INDEX_ANGLE) / (2.0 * pi)
    return 2.0 * pi * (ceil(turns) if side > 0 else floor(turns)) + INDEX_ANGLE, side


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("method", [*FIGURES, *(method + 16 for method in FIGURES)])
def test_home_is_where_the_figure_has_it(method: int, start: str) -> None:
    """Within the way of a servo period at the slow speed beyond the edge or pulse, and an encoder increment."""
    bench = bench_for(method, STARTS[start])
    assert run(bench) == ATTAINED
    angle, side = expected(bench, method)
    beyond = side * (bench.drive.axis.scaling.origin - angle)
    quantum = 1.0 / bench.units(1.0)
    assert -2.0 * quantum <= beyond <= SLOW * SERVO_PERIOD * 1.3 + 2.0 * quantum
    bench.sync(100)
    told = bench.read(0x6064) / bench.units(1.0)
    assert told == pytest.approx(bench.motor - bench.drive.axis.scaling.origin, abs=3.0 * quantum)


@pytest.mark.parametrize(("method", "side"), [(33, -1), (34, 1)])
def test_home_is_the_next_index_pulse(method: int, side: int) -> None:
    bench = bench_for(method, 0.013)
    turns = (bench.motor - INDEX_ANGLE) / (2.0 * pi)
    pulse = 2.0 * pi * (ceil(turns) if side > 0 else floor(turns)) + INDEX_ANGLE
    assert run(bench) == ATTAINED
    beyond = side * (bench.drive.axis.scaling.origin - pulse)
    assert -1e-5 <= beyond <= SLOW * SERVO_PERIOD * 1.3


@pytest.mark.parametrize("method", [15, 16, 31, 32, 36, -1])
def test_reserved_methods_are_an_error(method: int) -> None:
    assert method not in METHODS
    assert run(bench_for(method, 0.0), limit=5) == ERROR


def test_without_a_home_switch_its_methods_are_an_error() -> None:
    bench = bench_for(7, 0.0)
    bench.drive.hardware.home_switch = None
    assert run(bench, limit=5) == ERROR


@pytest.mark.parametrize("method", [7, 14, 19])
def test_a_home_switch_that_never_answers_is_an_error(method: int) -> None:
    """Both limit switches have been seen then."""
    bench = bench_for(method, 0.0)
    bench.drive.hardware.home_switch = NEVER
    assert run(bench) == ERROR
    assert bench.emergencies() == []


def test_polarity_turns_the_figures_round() -> None:
    """607Eh bit 7: the negative limit switch is the one towards negative positions."""
    bench = bench_for(17, 0.06)
    bench.write(0x607E, 0x80)
    assert run(bench) == ATTAINED
    assert bench.motor == pytest.approx(bench.drive.hardware.switches.high, abs=0.1)


@pytest.mark.parametrize(("method", "bit", "code"), [(17, 1, 0x5442), (1, 1, 0x5442), (18, 2, 0x5443), (2, 2, 0x5443)])
@pytest.mark.parametrize("polarity", [0, 0x80, 0xC0])
def test_the_switch_of_a_method_is_the_one_of_60fdh_and_603fh(polarity: int, method: int, bit: int, code: int) -> None:
    """CiA 402-2, methods 1, 2, 17, 18 and 60FDh bits 0, 1: 'negative' is towards negative positions, by 607Eh, everywhere."""
    bench = bench_for(method, 0.06)
    bench.write(0x607E, polarity)
    bench.write(0x6040, START)
    seen = 0
    for _ in range(12_000):
        bench.sync()
        seen |= int(bench.read(0x60FD)) & 3
        if int(bench.read(0x6041)) & 1 << 12:
            break
    assert seen == bit
    bench.write(0x6060, 3)
    towards = -1 if bit == 1 else 1
    bench.write(0x60FF, towards * (-1 if polarity == 0x80 else 1) * bench.units(20.0))
    bench.command(0x0F)
    bench.sync(1000)
    assert bench.emergencies() == [code]
