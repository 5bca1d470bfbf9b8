"""Friction pre-control of a ServoOne (2182h..2184h), additive torque 2191h, torque reference 21A2h: they act in the torque."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from drive_bench import CYCLE, INTERPOLATED, START, DriveBench

from drivetwin.emulator.drive.torque_precontrol import TorquePrecontrol

RPM = 2.0 * pi / 60.0
PER_CENT = 0.01


def write_true_friction(bench: DriveBench, points: tuple[float, float, float]) -> None:
    """The plant's true friction at three joint speeds, as the drive wants it: rpm and per cent of rated torque."""
    name = next(name for name, axis in bench.machine.axes.items() if axis is bench.configuration)
    truth = bench.virtual.plant.truth()[name]
    gear, rated = bench.configuration.gear_ratio, bench.configuration.motor.rated_torque
    for sub, speed in enumerate(points, start=1):
        level = truth["coulomb"] + truth["viscous"] * speed
        if "static_torque" in truth:
            excess = truth["static_torque"] - truth["coulomb"]
            level += excess * np.exp(-((speed / truth["stribeck_velocity"]) ** truth["exponent"]))
        bench.write(0x2182, level / gear / rated / PER_CENT, sub)
        bench.write(0x2183, speed * gear / RPM, sub)


def rms_error(machine: str, axis: str, points: tuple[float, float, float], compensated: bool) -> float:
    """Following error [rad of the motor] on strokes to and fro, raised cosines of 1 s."""
    bench = DriveBench(machine, axis, "servoone")
    bench.write(0x2177, 100.0)
    if compensated:
        write_true_friction(bench, points)
    bench.enable(INTERPOLATED)
    bench.write(0x60C1, bench.read(0x6064), 1)
    bench.command(START)
    origin = bench.read(0x6064)
    stroke = points[2] / pi * bench.configuration.gear_ratio
    errors = []
    for angle in stroke * 0.5 * (1.0 - np.cos(2.0 * pi * CYCLE * np.arange(2001))):
        bench.write(0x60C1, round(origin + angle * bench.units(1.0)), 1)
        bench.sync()
        errors.append(float(bench.drive.axis.servo.state["following_error"]))
    return float(np.sqrt(np.mean(np.square(errors[100:]))))


@pytest.mark.parametrize(
    ("machine", "axis", "points"),
    [("stage", "slide", (0.0, 0.01, 0.02)), ("scara", "rotate", (0.05, 0.4, 1.2)), ("scara", "lift", (0.005, 0.05, 0.1))],
)
def test_true_friction_in_the_table_lowers_the_following_error(
    machine: str, axis: str, points: tuple[float, float, float]
) -> None:
    """Measured: by 3.0 on slide, 3.2 on rotate, 3.0 on lift. What remains is inertia, which the table knows nothing of."""
    without, compensated = (rms_error(machine, axis, points, one) for one in (False, True))
    assert without / compensated > 2.5


def precontrol(**objects: float) -> tuple[DriveBench, TorquePrecontrol]:
    bench = DriveBench("scara", "rotate", "servoone")
    for name, value in objects.items():
        index, _, sub = name.removeprefix("x").partition("_")
        bench.write(int(index, 16), value, int(sub or "0"))
    return bench, TorquePrecontrol(bench.drive.axis)


def test_table_is_a_line_from_point_to_point() -> None:
    """10 % at 100 rpm, 20 % at 300 rpm of 0.4 N·m; constant outside, sign of the speed."""
    _, table = precontrol(x2182_1=10.0, x2183_1=100.0, x2182_2=20.0, x2183_2=300.0)
    speeds = np.array([600.0, 300.0, 200.0, 100.0, 50.0]) * RPM
    assert table.friction(speeds) == pytest.approx([0.08, 0.08, 0.06, 0.04, 0.04])
    assert table.friction(-speeds) == pytest.approx([-0.08, -0.08, -0.06, -0.04, -0.04])
    assert table.friction(np.zeros(3)) == pytest.approx(np.zeros(3))


def test_points_4_and_5_act_only_while_accelerating() -> None:
    _, table = precontrol(x2182_1=10.0, x2183_1=100.0, x2182_4=30.0, x2183_4=200.0)
    rising = np.array([180.0, 190.0, 200.0]) * RPM
    assert table.friction(rising)[-1] == pytest.approx(0.3 * 0.4)
    assert table.friction(rising[::-1].copy()) == pytest.approx(0.04)
    assert table.friction(-rising)[-1] == pytest.approx(-0.3 * 0.4)


def test_a_table_that_is_changed_or_reset_acts_anew() -> None:
    bench, _ = precontrol(x2182_1=10.0)
    table = bench.drive._precontrol
    bench.sync()
    assert table.friction(np.ones(2)) == pytest.approx(0.04)
    bench.write(0x2182, 20.0, 1)
    bench.sync()
    assert table.friction(np.ones(2)) == pytest.approx(0.08)
    bench.write(0x6076, 200)
    bench.sync()
    assert table.friction(np.ones(2)) == pytest.approx(0.04)
    bench.drive.device.receive(0, bytes((0x81, bench.configuration.node_id)))
    bench.sync()
    assert not table.friction(np.ones(2)).any()


def test_an_empty_table_adds_nothing() -> None:
    _, table = precontrol()
    assert not table.friction(np.linspace(-10.0, 10.0, 8)).any()


@pytest.mark.parametrize(("index", "value", "torque"), [(0x2191, 0.016, 0.016), (0x2184, 4.0, 0.04 * 0.4)])
def test_additive_and_constant_torque(index: int, value: float, torque: float) -> None:
    """2191h in N·m, 2184h in per cent, in one direction whatever the speed; both seen in 21A2h and 6074h."""
    bench = DriveBench("stage", "slide", "servoone")
    bench.enable(INTERPOLATED)
    bench.sync(10)
    before = bench.read(0x21A2)
    bench.write(index, value)
    bench.sync(20)
    assert bench.read(0x21A2) - before == pytest.approx(torque, rel=0.02)
    assert bench.read(0x6074) == pytest.approx(1000.0 * bench.read(0x21A2) / 0.4, abs=0.51)


def test_nothing_acts_while_disabled() -> None:
    bench = DriveBench("stage", "slide", "servoone")
    bench.write(0x2191, 0.1)
    bench.sync(20)
    assert bench.read(0x21A2) == 0.0
