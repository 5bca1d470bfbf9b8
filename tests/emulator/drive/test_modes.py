"""Modes of operation on a moving plant: what a master commands, against closed forms and the plant's truth."""

from __future__ import annotations

from contextlib import suppress
from math import pi
from pathlib import Path
from random import Random

import numpy as np
import pytest
from drive_bench import (
    CYCLE,
    CYCLIC,
    DISABLE_VOLTAGE,
    ENABLE,
    HALT,
    HOMING,
    INTERPOLATED,
    PROFILE_VELOCITY,
    SHUTDOWN,
    START,
    SWITCH_ON,
    DriveBench,
)

from drive_profiles import DataType
from emulator.canopen import SdoAbort
from emulator.canopen.data_types import type_range
from emulator.drive.servo import SERVO_PERIOD
from emulator.drive.state_machine import State

REACHED, ATTAINED, FAILED, RUNNING = 1 << 10, 1 << 12, 1 << 13, 0
"""Bits of the statusword that the modes own."""

AXES = [("scara", "lift"), ("scara", "rotate"), ("scara", "stretch"), ("stage", "slide"), ("arm", "shoulder")]


def mode_bits(bench: DriveBench) -> int:
    return int(bench.read(0x6041)) & (REACHED | ATTAINED | FAILED)


# -- enabling ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", [PROFILE_VELOCITY, HOMING, INTERPOLATED, CYCLIC])
@pytest.mark.parametrize(("machine", "axis"), AXES)
def test_enabling_does_not_jump(machine: str, axis: str, mode: int) -> None:
    """Without gravity nothing moves at all. Under it the axis gives way until the velocity loop has the load."""
    bench = DriveBench(machine, axis)
    bench.sync(5)
    bench.write(0x607A, bench.read(0x6064))
    start = bench.joint
    gravity = axis in ("lift", "shoulder")
    bench.write(0x6060, mode)
    furthest = 0.0
    for controlword in (SHUTDOWN, SWITCH_ON, *([ENABLE] * 400)):
        bench.command(controlword)
        furthest = max(furthest, abs(bench.joint - start))
    assert bench.state is State.OPERATION_ENABLED
    assert furthest < (3e-3 if gravity else 1e-7)
    assert abs(bench.joint_velocity) < 1e-3


@pytest.mark.parametrize(("machine", "axis"), [("scara", "lift"), ("arm", "shoulder")])
@pytest.mark.parametrize("before", [[], [SHUTDOWN, SWITCH_ON], [SHUTDOWN, SWITCH_ON, ENABLE, DISABLE_VOLTAGE]])
def test_holding_brake_holds_while_disabled(machine: str, axis: str, before: list[int]) -> None:
    bench = DriveBench(machine, axis)
    bench.command(*before)
    bench.sync(50)
    start = bench.joint
    bench.sync(1000)
    assert abs(bench.joint - start) < 1e-6
    assert bench.read(0x6074) == 0


def test_unknown_mode_is_refused() -> None:
    bench = DriveBench()
    with pytest.raises(SdoAbort):
        bench.write(0x6060, 5)
    with pytest.raises(SdoAbort):
        DriveBench(profile="servoone").write(0x6060, CYCLIC)


@pytest.mark.parametrize("mode", [PROFILE_VELOCITY, HOMING, INTERPOLATED, CYCLIC])
def test_mode_display(mode: int) -> None:
    bench = DriveBench()
    bench.enable(mode)
    assert bench.read(0x6061) == mode


# -- profile velocity -------------------------------------------------------------------------------------------------

UP, DOWN, SPEED = 500.0, 250.0, 50.0


def velocity_bench() -> DriveBench:
    bench = DriveBench()
    bench.write(0x6083, bench.units(UP))
    bench.write(0x6084, bench.units(DOWN))
    bench.enable(PROFILE_VELOCITY)
    return bench


def test_velocity_ramps_as_given() -> None:
    """Up by 6083h, down by 6084h; a reversal slows down to zero by 6084h and speeds up by 6083h."""
    bench = velocity_bench()
    unit = bench.units(1.0)
    cycles = np.arange(1, 301)
    for start, target in ((0.0, SPEED), (SPEED, 20.0), (20.0, -30.0), (-30.0, 0.0)):
        bench.write(0x60FF, bench.units(target))
        demand = bench.record(300, 0x606B)[:, 0] / unit
        expected = closed_form(start, target, cycles * CYCLE)
        assert np.abs(demand - expected).max() < 1.5 * UP * SERVO_PERIOD
        steady = bench.record(50, 0x606C)[:, 0].mean() / unit
        assert steady == pytest.approx(target, rel=0.15, abs=0.05)


def closed_form(start: float, target: float, time: np.ndarray) -> np.ndarray:
    if start * target < 0.0:
        to_zero = abs(start) / DOWN
        before = start - np.sign(start) * DOWN * time
        after = np.sign(target) * np.minimum(UP * (time - to_zero), abs(target))
        return np.where(time < to_zero, before, after)
    rate = UP if abs(target) > abs(start) else DOWN
    change = np.minimum(rate * time, abs(target - start))
    return np.asarray(start + np.sign(target - start) * change)


def test_speed_is_limited_by_607f() -> None:
    bench = velocity_bench()
    bench.write(0x607F, bench.units(12.0))
    for sign in (1, -1):
        bench.write(0x60FF, sign * bench.units(SPEED))
        bench.sync(300)
        assert bench.read(0x606B) == pytest.approx(sign * bench.units(12.0), abs=1)


def test_an_acceleration_of_zero_is_no_limit() -> None:
    bench = DriveBench()
    bench.enable(PROFILE_VELOCITY)
    for target in (SPEED, -SPEED, 0.0):
        bench.write(0x60FF, bench.units(target))
        bench.sync()
        assert bench.read(0x606B) == bench.units(target)


def test_velocity_status_bits() -> None:
    """Bit 10 target reached, bit 12 speed is 0."""
    bench = velocity_bench()
    bench.drive.axis.servo.parameters["integral_rate"] = 100.0
    bench.sync(2)
    assert mode_bits(bench) == REACHED | 1 << 12
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(50)
    assert mode_bits(bench) == 0
    bench.sync(300)
    assert mode_bits(bench) == REACHED


def test_enabling_a_coasting_axis_starts_from_its_speed() -> None:
    bench = velocity_bench()
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(300)
    bench.command(DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON)
    speed = bench.joint_velocity * bench.configuration.gear_ratio
    bench.command(ENABLE)
    assert bench.read(0x606B) / bench.units(1.0) == pytest.approx(speed, rel=0.1)


# -- homing -----------------------------------------------------------------------------------------------------------

FAST, SLOW = 60.0, 6.0


def homing_bench(method: int, offset: int = 12_345, machine: str = "stage", axis: str = "slide") -> DriveBench:
    bench = DriveBench(machine, axis)
    bench.write(0x6098, method)
    bench.write(0x6099, bench.units(FAST), 1)
    bench.write(0x6099, bench.units(SLOW), 2)
    bench.write(0x609A, bench.units(2000.0))
    bench.write(0x607C, offset)
    bench.enable(HOMING)
    assert mode_bits(bench) == REACHED  # not started
    return bench


def home(bench: DriveBench, limit: int = 12_000) -> set[int]:
    """Start and run to the end of homing; the status bits on the way."""
    bench.write(0x6040, START)
    seen: set[int] = set()
    for _ in range(limit):
        bench.sync()
        bits = mode_bits(bench)
        if bits == REACHED | ATTAINED or bits & FAILED:
            return seen
        seen.add(bits)
    raise AssertionError(f"homing did not end; status bits {seen}")


@pytest.mark.parametrize(("machine", "axis"), [("stage", "slide"), ("scara", "lift"), ("scara", "stretch")])
@pytest.mark.parametrize("method", [17, 18])
def test_home_is_the_edge_of_the_switch(method: int, machine: str, axis: str) -> None:
    """Within the way of one servo period at the slow speed, and an increment; the zero is 607Ch beyond it (CiA 402-2)."""
    bench = homing_bench(method, machine=machine, axis=axis)
    assert home(bench) <= {RUNNING, ATTAINED}
    bench.sync(300)
    switches = bench.configuration.limit_switches
    edge = switches.negative if method == 17 else switches.positive
    away = bench.motor - edge * bench.configuration.gear_ratio
    told = (bench.read(0x6064) + 12_345) / bench.units(1.0)
    assert abs(told - away) < SLOW * SERVO_PERIOD + 2.0 / bench.units(1.0)
    assert away > 0.0 if method == 17 else away < 0.0
    assert int(bench.read(0x60FD)) & 3 == 0
    assert bench.state is State.OPERATION_ENABLED


def test_homing_that_begins_on_the_switch() -> None:
    bench = homing_bench(17)
    home(bench)
    bench.command(ENABLE)
    bench.write(0x6060, PROFILE_VELOCITY)
    bench.write(0x6083, bench.units(500.0))
    bench.write(0x60FF, -bench.units(5.0))
    bench.sync(2000)
    assert int(bench.read(0x60FD)) & 3 == 1
    assert bench.emergencies() == [0x5442]
    bench.command(0x80, SHUTDOWN)
    bench.enable(HOMING)
    bench.sync(50)
    home(bench)
    bench.sync(200)
    away = bench.motor - bench.configuration.limit_switches.negative * bench.configuration.gear_ratio
    assert (bench.read(0x6064) + 12_345) / bench.units(1.0) == pytest.approx(away, abs=1.5 * SLOW * SERVO_PERIOD)


@pytest.mark.parametrize("method", [35, 37])
@pytest.mark.parametrize("polarity", [0x00, 0x80])
def test_home_is_here(method: int, polarity: int) -> None:
    bench = homing_bench(method)
    bench.write(0x607E, polarity)
    start = bench.joint
    home(bench, limit=3)
    assert bench.read(0x6064) == pytest.approx(-12_345, abs=1)
    assert bench.joint == pytest.approx(start, abs=1e-9)


def test_a_homing_method_that_is_not_there() -> None:
    bench = homing_bench(15)
    home(bench, limit=3)
    assert mode_bits(bench) == FAILED | REACHED  # error, and the axis stands


def test_homing_is_interrupted_by_bit_4() -> None:
    bench = homing_bench(17)
    bench.command(START)
    bench.sync(200)
    assert mode_bits(bench) == RUNNING
    bench.command(ENABLE)
    bench.sync(200)
    assert mode_bits(bench) == REACHED
    assert abs(bench.joint_velocity) < 1e-6


def test_homing_takes_over_a_moving_axis_by_its_ramp() -> None:
    bench = velocity_bench()
    bench.write(0x60FF, bench.units(SPEED))
    bench.sync(300)
    bench.write(0x609A, bench.units(UP))
    speed = bench.joint_velocity * bench.configuration.gear_ratio
    bench.write(0x6060, HOMING)
    way = -bench.motor
    bench.sync(200)
    way += bench.motor
    assert way == pytest.approx(speed**2 / (2.0 * UP), rel=0.2)
    assert abs(bench.joint_velocity) < 1e-4


# -- positions, streamed ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("profile", "mode"), [("cia402-full", CYCLIC), ("cia402-full", INTERPOLATED), ("servoone", INTERPOLATED)]
)
def test_the_axis_follows_what_is_streamed(profile: str, mode: int) -> None:
    """A raised cosine of 0.2 rad on rotate; linear reaches each point at its cycle's end, the spline a cycle later."""
    bench = DriveBench("scara", "rotate", profile)
    bench.enable(mode)
    bench.command(START)
    place = (0x60C1, 1) if mode == INTERPOLATED else (0x607A, 0)
    start, gear = bench.motor, bench.configuration.gear_ratio
    origin = bench.read(0x6064)
    moves = 0.1 * gear * (1.0 - np.cos(2.0 * pi * np.arange(501) / 500))
    demanded, errors = [], []
    for angle in moves:
        bench.write(place[0], round(origin + angle * bench.units(1.0)), place[1])
        bench.sync()
        demanded.append(float(bench.drive.axis.servo.demand[-1, 0]) - start)
        errors.append(bench.motor - start - angle)
    spline = profile == "servoone"
    reached = np.array(demanded[1:]) - (moves[:-1] if spline else moves[1:])
    acceleration = 0.1 * gear * (2.0 * pi / 0.5) ** 2
    allowed = 2.0 / bench.units(1.0) + (acceleration * CYCLE**2 / 6.0 if spline else 0.0)
    assert np.abs(reached).max() < allowed
    assert np.abs(errors).max() / gear < 0.01  # followed, to a twentieth of the stroke
    assert np.ptp(np.array(errors)) > 0.0


def test_interpolation_waits_for_bit_4() -> None:
    bench = DriveBench("scara", "rotate")
    bench.enable(INTERPOLATED)
    start = bench.joint
    bench.write(0x60C1, bench.units(1.0), 1)
    bench.sync(100)
    assert bench.joint == pytest.approx(start, abs=1e-7)
    assert not int(bench.read(0x6041)) & 1 << 12
    bench.command(START)
    assert int(bench.read(0x6041)) & 1 << 12
    bench.sync(300)
    assert (bench.joint - start) * 50.0 == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("mode", [CYCLIC, INTERPOLATED])
def test_velocity_offset_is_added_to_the_velocity_demand(mode: int) -> None:
    """On the stage, whose velocity loop is P: 606Bh and 6074h say it while stiction holds the axis."""
    bench = DriveBench()
    bench.enable(mode)
    bench.sync(10)
    still = bench.read(0x606B), bench.read(0x6074)
    offset = 0.5
    bench.write(0x60B1, bench.units(offset))
    bench.sync()
    gain = 8500.0 / bench.configuration.gear_ratio**2
    assert bench.read(0x606B) - still[0] == pytest.approx(bench.units(offset), abs=101)  # an increment by 1/s
    assert bench.read(0x6074) - still[1] == pytest.approx(1000.0 * gain * offset / 0.4, abs=1.0)


@pytest.mark.parametrize("mode", [CYCLIC, INTERPOLATED, PROFILE_VELOCITY])
def test_torque_offset_is_added_to_the_torque_demand(mode: int) -> None:
    bench = DriveBench()
    bench.enable(mode)
    bench.sync(10)
    bench.write(0x60B2, 50)
    bench.sync(20)
    assert bench.read(0x6074) == pytest.approx(50, abs=1)
    assert bench.read(0x6077) == pytest.approx(50, abs=4.0 * 4.0 + 1)  # noise of 0.4 % of rated torque
    assert bench.virtual.plant.motor_torque[0] == pytest.approx(0.05 * 0.4, rel=0.02)


# -- limits and faults ------------------------------------------------------------------------------------------------


def test_max_torque_limits() -> None:
    """6072h = 150: 0.06 N·m less friction accelerates the stage, no more."""
    bench = DriveBench()
    bench.write(0x6072, 150)
    bench.write(0x6083, bench.units(1e4))
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, bench.units(100.0))
    bench.sync(20)
    before = bench.joint_velocity
    rows = bench.record(100, 0x6074)
    assert rows.min() == rows.max() == 150
    force = 0.15 * 0.4 * bench.configuration.gear_ratio - 20.4 - (203.5 - 36.0) * 0.5 * (before + bench.joint_velocity)
    assert (bench.joint_velocity - before) / 0.1 == pytest.approx(force / 95.0014, rel=0.01)


def test_torque_limit_follows_the_rated_torque() -> None:
    bench = DriveBench()
    bench.write(0x6072, 500)
    bench.sync()
    assert bench.drive.axis.servo.parameters["torque_limit"] == pytest.approx(0.2)
    bench.write(0x6076, 200)
    bench.sync()
    assert bench.drive.axis.servo.parameters["torque_limit"] == pytest.approx(0.1)


def test_no_object_makes_a_motor_stronger_than_it_is() -> None:
    """The motor's and the power stage's peak torque bounds every limit that a master writes."""
    bench = DriveBench()
    bench.write(0x6072, 65_535)
    bench.write(0x60F9, 1e30, 5)
    bench.sync()
    assert bench.drive.axis.servo.parameters["torque_limit"] == pytest.approx(1.2)


@pytest.mark.parametrize("seed", range(12))
def test_whatever_is_written_the_plant_lives(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Any values in any objects: no exception, and MuJoCo finds nothing bad (it would reset its time)."""
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its warnings to a file there
    random = Random(seed)
    bench = DriveBench("scara", "rotate", random.choice(["servoone", "cia402-full"]))
    writable = [one for one in bench.drive.dictionary if one.access.writable and one.index >= 0x2000 and one.size]
    for _ in range(60):
        for variable in random.sample(writable, 3):
            low, high = type_range(variable.data_type)
            value = random.choice([low, high, 0, 1, random.uniform(0, 100), random.uniform(low, high) / 1000.0])
            with suppress(SdoAbort):
                variable.write(value if variable.data_type is DataType.R32 else int(value))
        bench.write(0x6060, random.choice([3, 6, 7]))
        bench.command(random.choice([6, 7, 15, 15, START, HALT, 2, 0x80]))
        for variable in bench.drive.dictionary:
            if variable.index >= 0x2000:
                variable.encode()
    assert bench.virtual.plant.time == pytest.approx(bench.virtual.now(), abs=1e-9)
    assert np.isfinite(bench.virtual.plant.joint_positions()).all()


def test_rated_torque_is_one_quantity_in_two_objects() -> None:
    bench = DriveBench(profile="servoone")
    bench.write(0x21CC, 0.25)
    assert bench.read(0x6076) == 250
    bench.write(0x6076, 300)
    assert bench.read(0x21CC) == pytest.approx(0.3)


def test_a_rated_torque_of_zero_is_no_division() -> None:
    bench = DriveBench()
    bench.write(0x6076, 0)
    bench.enable(CYCLIC)
    assert bench.read(0x6077) == 0


def test_following_error_stops_the_axis() -> None:
    """EMCY 8611h, fault reaction, fault; the axis ends at rest."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x6065, bench.units(0.5))
    bench.write(0x6085, bench.units(4000.0))
    bench.enable(CYCLIC)
    bench.write(0x607A, bench.units(0.4))
    bench.sync(200)
    assert bench.state is State.OPERATION_ENABLED
    bench.write(0x607A, bench.units(40.0))
    bench.sync(2)
    assert bench.emergencies() == [0x8611]
    assert bench.state in (State.FAULT_REACTION_ACTIVE, State.FAULT)
    bench.sync(500)
    assert bench.state is State.FAULT
    assert abs(bench.joint_velocity) < 1e-6
    assert bench.read(0x6074) == 0


def test_following_error_time_out() -> None:
    """6066h: an error that lasts 20 ms or less is none."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x6065, bench.units(0.5))
    bench.write(0x6066, 20)
    bench.write(0x6072, 0)
    bench.enable(CYCLIC)
    bench.write(0x607A, bench.units(1.0))
    bench.sync(19)
    assert bench.emergencies() == []
    bench.sync(2)
    assert bench.emergencies() == [0x8611]


def test_following_error_limit_of_a_servoone() -> None:
    bench = DriveBench("scara", "rotate", "servoone")
    bench.write(0x22E7, bench.units(0.5))
    bench.enable(INTERPOLATED)
    bench.write(0x60C1, bench.units(5.0), 1)
    bench.command(START)
    bench.sync(3)
    assert bench.emergencies() == [0x8611]


# -- scaling ----------------------------------------------------------------------------------------------------------


def test_scaling_to_millidegrees_of_the_joint() -> None:
    """6091h = 50:1, 6092h = 360000:1: a turn of the joint is 360000 units."""
    bench = DriveBench("scara", "rotate")
    for index, subindex, value in ((0x6091, 1, 50), (0x6091, 2, 1), (0x6092, 1, 360_000), (0x6092, 2, 1)):
        bench.write(index, value, subindex)
    bench.enable(CYCLIC)
    start = bench.joint
    for target in np.linspace(0.0, 10_000.0, 500):
        bench.write(0x607A, round(target))
        bench.sync()
    speed = bench.joint_velocity
    assert bench.read(0x606C) == pytest.approx(speed * 180.0 / pi * 1000.0, rel=0.02)
    bench.sync(500)
    assert (bench.joint - start) * 180.0 / pi == pytest.approx(10.0, abs=0.002)
    assert bench.read(0x6064) == pytest.approx((bench.joint - start) * 180.0 / pi * 1000.0, abs=1.0)
    assert bench.read(0x6063) == pytest.approx((bench.joint - start) * 50.0 / (2.0 * pi) * 1048576, abs=1.5)


def test_scaling_to_micrometres_with_another_resolution() -> None:
    """608Fh = 2097152:2 is the encoder's own; a screw of 10 mm a turn as 6092h = 30000:3 um."""
    bench = DriveBench()
    for index, subindex, value in ((0x608F, 1, 2_097_152), (0x608F, 2, 2), (0x6092, 1, 30_000), (0x6092, 2, 3)):
        bench.write(index, value, subindex)
    bench.write(0x6083, 200_000)
    bench.enable(PROFILE_VELOCITY)
    start = bench.joint
    bench.write(0x60FF, 50_000)
    bench.sync(500)
    assert bench.read(0x606B) == 50_000
    assert bench.read(0x6064) == pytest.approx((bench.joint - start) * 1e6, rel=1e-3)
    assert bench.read(0x6064) > 5_000


def test_polarity() -> None:
    """607Eh bit 7 turns positions round, bit 6 velocities, each alone."""
    bench = DriveBench()
    bench.write(0x6083, bench.units(500.0))
    bench.enable(PROFILE_VELOCITY)
    bench.write(0x60FF, bench.units(20.0))
    bench.sync(200)
    position, velocity = bench.read(0x6064), bench.read(0x606C)
    assert position > 0
    assert velocity > 0
    for polarity, signs in ((0x80, (-1, 1)), (0x40, (1, -1)), (0xC0, (-1, -1))):
        bench.write(0x607E, polarity)
        assert bench.read(0x6064) == pytest.approx(signs[0] * position, abs=1)
        assert bench.read(0x606C) == pytest.approx(signs[1] * velocity, abs=1)
    bench.sync(400)
    assert bench.joint_velocity < 0.0


# -- loops' parameters ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_loops_are_as_commissioned_and_as_written(profile: str) -> None:
    bench = DriveBench("scara", "rotate", profile)
    bench.sync()
    parameters, roles = bench.drive.axis.servo.parameters, bench.drive.profile.roles
    expected = {
        "position_gain": 40.0,
        "velocity_gain": 32.0 / 50.0**2,
        "integral_rate": 1.0 / 0.02,
        "velocity_feedforward": 1.0,
        "velocity_filter": 1.0 - np.exp(-SERVO_PERIOD * 2.0 * pi * 300.0),
        "current_filter": 1.0 - np.exp(-SERVO_PERIOD / 0.0005),
        "torque_limit": 1.2,
        "encoder_quantum": 2.0 * pi / 1048576,
        "torque_noise": 0.0016,
        "torque_quantum": 0.0002,
    }
    assert {name: float(parameters[name]) for name in expected} == pytest.approx(expected, rel=1e-6)
    for role, field, value, becomes in (
        ("position_gain", "position_gain", 25.0, 25.0),
        ("integral_time", "integral_rate", 0.04, 25.0),
        ("integral_time", "integral_rate", 0.0, 0.0),
        ("velocity_feedforward", "velocity_feedforward", 0.5, 0.5),
        ("torque_limit", "torque_limit", 0.7, 0.7),
    ):
        place = roles[role]
        bench.write(place.index, value / place.si_per_unit, place.subindex)
        bench.sync()
        assert float(parameters[field]) == pytest.approx(becomes)
    bench.drive.device.receive(0, bytes((0x81, 2)))
    bench.sync()
    assert {name: float(parameters[name]) for name in expected} == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_float_torque_and_per_mille_are_the_same_reading(profile: str) -> None:
    bench = DriveBench("scara", "lift", profile)
    bench.enable(PROFILE_VELOCITY)
    bench.sync(300)
    for _ in range(20):
        bench.sync()
        assert bench.read(0x6077) == pytest.approx(1000.0 * bench.read(0x21A3) / 1.27, abs=0.51)
    assert bench.read(0x21A3) * 2.0 * pi / 0.01 == pytest.approx(17.25 * 9.81, abs=45.0)  # gravity within stiction
