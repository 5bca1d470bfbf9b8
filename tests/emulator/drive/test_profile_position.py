"""CiA 402-2, clause 'Profile position mode': handshake, single and set of set-points, relative, halt, windows, profiles."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np
import pytest
from drive_bench import CYCLE, ENABLE, DriveBench

POSITION_MODE = 1
NEW, IMMEDIATELY, RELATIVE, HALT, FLYING = 0x10, 0x20, 0x40, 0x100, 0x200
REACHED, ACKNOWLEDGED, LIMIT = 1 << 10, 1 << 12, 1 << 11
SPEED, UP, DOWN = 20.0, 400.0, 200.0


def position_bench(profile: str = "cia402-full") -> DriveBench:
    bench = DriveBench("scara", "rotate", profile)
    for index, value in ((0x6081, SPEED), (0x6083, UP), (0x6084, DOWN), (0x6085, 2000.0)):
        bench.write(index, bench.units(value))
    bench.enable(POSITION_MODE)
    bench.sync(50)
    return bench


def send(bench: DriveBench, target: float, bits: int = 0) -> None:
    """A set-point [rad of the motor] with its handshake."""
    bench.write(0x607A, bench.units(target))
    bench.write(0x6040, ENABLE | bits)
    bench.sync()
    bench.write(0x6040, ENABLE | NEW | bits)
    bench.sync()
    assert status(bench) & ACKNOWLEDGED
    bench.write(0x6040, ENABLE | bits)
    bench.sync()


def status(bench: DriveBench) -> int:
    return int(bench.read(0x6041))


def demand(bench: DriveBench) -> float:
    """Demanded motor angle [rad], from the zero."""
    return float(bench.drive.axis.servo.demand[-1, 0]) - bench.drive.axis.scaling.origin


def speed(bench: DriveBench) -> float:
    return float(bench.drive.axis.servo.demand[-1, 1])


def cycles_until_reached(bench: DriveBench, limit: int = 5000) -> int:
    for cycle in range(limit):
        if status(bench) & REACHED:
            return cycle
        bench.sync()
    raise AssertionError("target not reached")


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_moves_to_the_target_in_the_time_of_the_profile(profile: str) -> None:
    bench = position_bench(profile)
    start = demand(bench)
    bench.write(0x607A, bench.units(10.0))
    bench.write(0x6040, ENABLE | NEW)
    cycles = cycles_until_reached(bench)
    way = 10.0 - start
    expected = way / SPEED + 0.5 * SPEED * (1.0 / UP + 1.0 / DOWN)
    assert cycles * CYCLE == pytest.approx(expected, abs=2 * CYCLE)
    assert demand(bench) == pytest.approx(10.0, abs=1e-5)
    bench.sync(300)
    assert bench.read(0x6064) == pytest.approx(bench.units(10.0), abs=bench.units(0.02))


@pytest.mark.parametrize("controlwords", [[ENABLE | NEW] * 5])
def test_acknowledge_falls_only_after_bit_4(controlwords: list[int]) -> None:
    bench = position_bench()
    bench.write(0x607A, bench.units(1.0))
    for controlword in controlwords:
        bench.command(controlword)
        assert status(bench) & ACKNOWLEDGED
    bench.command(ENABLE)
    assert not status(bench) & ACKNOWLEDGED


def test_without_an_edge_of_bit_4_there_is_no_new_set_point() -> None:
    bench = position_bench()
    start = demand(bench)
    bench.write(0x607A, bench.units(5.0))
    bench.sync(100)
    assert demand(bench) == pytest.approx(start, abs=1e-9)
    bench.command(ENABLE | NEW)
    bench.write(0x607A, bench.units(-5.0))
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(5.0, abs=1e-5)


@pytest.mark.parametrize("cycle", [1000, 10_000])
def test_an_edge_before_the_first_cycle_is_a_new_set_point(cycle: int) -> None:
    """CiA 402-2, 'Profile position mode': bit 4 rises after 0237h has been read, though no cycle has passed since 000Fh."""
    bench = DriveBench("scara", "rotate")
    for index, value in ((0x6081, SPEED), (0x6083, UP), (0x6084, DOWN)):
        bench.write(index, bench.units(value))
    bench.write(0x1006, cycle)
    bench.write(0x6060, POSITION_MODE)
    bench.command(0x06, 0x07)
    bench.write(0x6040, ENABLE)
    assert status(bench) & 0x6F == 0x27
    bench.write(0x607A, bench.units(2.0))
    bench.write(0x6040, ENABLE | NEW)
    bench.sync()
    assert status(bench) & ACKNOWLEDGED
    bench.sync(round(2_000_000 / cycle))
    assert bench.read(0x6064) == pytest.approx(bench.units(2.0), rel=0.01)


def test_an_edge_right_after_a_change_of_mode_is_a_new_set_point() -> None:
    """From mode 3, enabled: 6060h = 1 and the edge of bit 4 between two SYNCs."""
    bench = DriveBench("scara", "rotate")
    for index, value in ((0x6081, SPEED), (0x6083, UP), (0x6084, DOWN)):
        bench.write(index, bench.units(value))
    bench.enable(3)
    bench.write(0x6060, POSITION_MODE)
    bench.write(0x607A, bench.units(2.0))
    bench.write(0x6040, ENABLE | NEW)
    bench.sync()
    assert status(bench) & ACKNOWLEDGED


def test_a_pulse_before_the_first_cycle_is_a_new_set_point() -> None:
    bench = DriveBench("scara", "rotate")
    for index, value in ((0x6081, SPEED), (0x6083, UP), (0x6084, DOWN)):
        bench.write(index, bench.units(value))
    bench.write(0x6060, POSITION_MODE)
    bench.command(0x06, 0x07)
    bench.write(0x607A, bench.units(2.0))
    for controlword in (ENABLE, ENABLE | NEW, ENABLE):
        bench.write(0x6040, controlword)
    bench.sync(2000)
    assert bench.read(0x6064) == pytest.approx(bench.units(2.0), rel=0.01)


def test_bit_4_that_was_set_when_operation_was_enabled_is_no_edge() -> None:
    bench = DriveBench("scara", "rotate")
    bench.write(0x6081, bench.units(SPEED))
    bench.write(0x607A, bench.units(2.0))
    bench.write(0x6060, POSITION_MODE)
    bench.command(0x06, 0x07, ENABLE | NEW, ENABLE | NEW)
    assert not status(bench) & ACKNOWLEDGED


def over(bench: DriveBench, cycles: int, of: Callable[[DriveBench], float]) -> list[float]:
    """What is read after each of the next cycles."""
    values = []
    for _ in range(cycles):
        bench.sync()
        values.append(of(bench))
    return values


def test_change_immediately() -> None:
    """Bit 5: the new target replaces the one in progress, without a stop where the way goes on."""
    bench = position_bench()
    send(bench, 10.0)
    bench.sync(200)
    send(bench, 20.0, IMMEDIATELY)
    slowest = min(over(bench, 200, speed))
    assert slowest == pytest.approx(SPEED)
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(20.0, abs=1e-5)


def test_change_immediately_backwards() -> None:
    bench = position_bench()
    send(bench, 10.0)
    bench.sync(200)
    turn = demand(bench)
    send(bench, 0.0, IMMEDIATELY)
    furthest = max(over(bench, 400, demand))
    assert furthest - turn == pytest.approx(SPEED**2 / (2.0 * DOWN), abs=3.0 * SPEED * CYCLE)
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(0.0, abs=1e-5)


def test_set_of_set_points_waits_for_the_first() -> None:
    """Without bit 5 the second target is processed after the first is reached; bit 12 stays until there is room again."""
    bench = position_bench()
    send(bench, 4.0)
    bench.write(0x607A, bench.units(-2.0))
    bench.command(ENABLE | NEW, ENABLE)
    assert status(bench) & ACKNOWLEDGED  # the buffer is full
    bench.write(0x607A, bench.units(50.0))
    bench.command(ENABLE | NEW, ENABLE)  # no room: ignored
    path = []
    while status(bench) & ACKNOWLEDGED:
        bench.sync()
        path.append(demand(bench))
    assert max(path) == pytest.approx(4.0, abs=1e-5)
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(-2.0, abs=1e-5)


def test_change_on_set_point_passes_at_speed() -> None:
    """Bit 9: the first target is passed at its profile velocity, then the second is made for."""
    bench = position_bench()
    send(bench, 5.0)
    send(bench, 15.0, FLYING)
    at_first = None
    while not status(bench) & REACHED:
        bench.sync()
        if at_first is None and demand(bench) >= 5.0:
            at_first = speed(bench)
    assert at_first == pytest.approx(SPEED)
    assert demand(bench) == pytest.approx(15.0, abs=1e-5)


def test_relative_adds_to_the_preceding_target() -> None:
    bench = position_bench()
    send(bench, 3.0)
    cycles_until_reached(bench)
    for expected in (4.0, 5.0):
        send(bench, 1.0, RELATIVE)
        cycles_until_reached(bench)
        assert demand(bench) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("option", [0, 1, 2])
def test_what_relative_is_relative_to(option: int) -> None:
    """60F2h bits 0 and 1: 0 the preceding target, 1 the demanded, 2 the actual position."""
    bench = position_bench()
    bench.write(0x60F2, option)
    send(bench, 8.0)
    bench.sync(150)
    bench.write(0x607A, bench.units(2.0))
    bench.write(0x6040, ENABLE | IMMEDIATELY | RELATIVE)
    bench.sync()
    base = (8.0, demand(bench), float(bench.read(0x6064)) / bench.units(1.0))[option]
    bench.write(0x6040, ENABLE | NEW | IMMEDIATELY | RELATIVE)
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(base + 2.0, abs=1e-4)


def test_halt_interrupts_and_goes_on() -> None:
    bench = position_bench()
    send(bench, 10.0)
    bench.sync(200)
    bench.command(ENABLE | HALT)
    bench.sync(round(SPEED / DOWN / CYCLE) + 2)
    assert status(bench) & REACHED  # the axis stands
    held = demand(bench)
    bench.sync(200)
    assert demand(bench) == pytest.approx(held, abs=1e-9)
    bench.command(ENABLE)
    assert not status(bench) & REACHED
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(10.0, abs=1e-5)


@pytest.mark.parametrize(("profile", "index"), [("cia402-full", 0x6067), ("servoone", 0x22EA)])
def test_target_reached_is_within_the_window(profile: str, index: int) -> None:
    """Demand at the target is not enough: the axis has to be in the window (6067h; 22EAh of a ServoOne)."""
    bench = position_bench(profile)
    bench.write(index, bench.units(0.002))
    send(bench, 6.0)
    while speed(bench) != 0.0:
        assert not status(bench) & REACHED
        bench.sync()
    cycles_until_reached(bench)
    assert abs(bench.read(0x6064) - bench.units(6.0)) <= bench.units(0.002)


def test_position_window_time() -> None:
    """6068h: only after 100 ms within the window."""
    quick, patient = position_bench(), position_bench()
    patient.write(0x6068, 100)
    cycles = []
    for bench in (quick, patient):
        bench.write(0x6067, bench.units(0.05))
        send(bench, 6.0)
        cycles.append(cycles_until_reached(bench))
    assert cycles[1] - cycles[0] == pytest.approx(100, abs=2)


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_jerk_limited_profile(profile: str) -> None:
    """6086h = 3 with the jerk of 60A4h:01, or of the jerk time 20A6h of a ServoOne: 20 ms to the acceleration."""
    bench = position_bench(profile)
    bench.write(0x6086, 3)
    acceleration = 100.0
    bench.write(0x6083, bench.units(acceleration))
    jerk = acceleration / 0.02
    if profile == "servoone":
        bench.write(0x20A6, 20)
    else:
        bench.write(0x60A4, bench.units(jerk), 1)
    bench.write(0x607A, bench.units(10.0))
    bench.write(0x6040, ENABLE | NEW)
    speeds = []
    while not status(bench) & REACHED:
        bench.sync()
        speeds.append(speed(bench))
    accelerations = np.diff(speeds) / CYCLE
    assert np.abs(np.diff(accelerations)).max() / CYCLE <= jerk * 1.001
    assert accelerations.max() == pytest.approx(acceleration, rel=1e-3)
    assert demand(bench) == pytest.approx(10.0, abs=1e-5)


def test_a_target_beyond_the_software_limit_is_the_limit() -> None:
    """607Dh; statusword bit 11 says so."""
    bench = position_bench()
    bench.write(0x607D, bench.units(-3.0), 1)
    bench.write(0x607D, bench.units(3.0), 2)
    send(bench, 9.0)
    assert status(bench) & LIMIT
    cycles_until_reached(bench)
    assert demand(bench) == pytest.approx(3.0, abs=1e-5)
    send(bench, 1.0)
    assert not status(bench) & LIMIT


@pytest.mark.parametrize(
    ("index", "value", "expected"),
    [(0x607F, 8.0, 8.0), (0x60C5, 50.0, None), (0x60C6, 50.0, None)],
)
def test_profiles_keep_the_limits(index: int, value: float, expected: float | None) -> None:
    """607Fh max profile velocity, 60C5h max acceleration, 60C6h max deceleration."""
    bench = position_bench()
    bench.write(index, bench.units(value))
    start = demand(bench)
    send(bench, 10.0)
    speeds = []
    while not status(bench) & REACHED:
        bench.sync()
        speeds.append(speed(bench))
    rates = np.diff(speeds) / CYCLE
    up, down = (min(UP, value) if index == 0x60C5 else UP), (min(DOWN, value) if index == 0x60C6 else DOWN)
    peak = min(expected or SPEED, sqrt(2.0 * (10.0 - start) * up * down / (up + down)))
    assert max(speeds) == pytest.approx(peak, rel=0.02)
    assert rates.max() <= up * 1.001
    assert rates.min() >= -down * 1.001


def test_6080h_limits_the_motor_speed() -> None:
    """In rpm."""
    bench = position_bench()
    bench.write(0x6080, 60)
    send(bench, 10.0)
    fastest = 0.0
    while not status(bench) & REACHED:
        bench.sync()
        fastest = max(fastest, speed(bench))
    assert fastest == pytest.approx(2.0 * np.pi, rel=1e-6)
