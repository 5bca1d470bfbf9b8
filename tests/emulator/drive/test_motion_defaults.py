"""A drive as a master finds it that sets nothing but mode, target and controlword: it moves, and where it cannot it says so.

CiA 402-2, 'Profile position mode': bit 10 is 'target reached', and so not set where the axis is not at the target. What a
drive has in 6081h, 6083h, 6084h at power-on is its maker's choice; real ones move.
"""

from __future__ import annotations

import pytest
from drive_bench import ENABLE, HOMING, PROFILE_VELOCITY, START, DriveBench

from drivetwin.drive_profiles import load_profile

POSITION_MODE, VELOCITY_MODE, TORQUE_MODE = 1, 2, 4
NEW = 0x1F
REACHED, ACKNOWLEDGED, WARNING = 1 << 10, 1 << 12, 1 << 7
PROFILES = ["cia402-full", "servoone", "dryve_d1"]
AXES = [("stage", "slide"), ("scara", "rotate"), ("scara", "lift"), ("arm", "shoulder")]
MOTION = [(0x6081, 0), (0x6083, 0), (0x6084, 0), (0x6085, 0), (0x6087, 0), (0x6099, 1), (0x6099, 2), (0x609A, 0), (0x60A4, 1)]
MOTION += [(index, subindex) for index in (0x6048, 0x6049, 0x604A) for subindex in (1, 2)]


def status(bench: DriveBench) -> int:
    return int(bench.read(0x6041))


@pytest.mark.parametrize("profile", PROFILES)
def test_no_motion_object_is_zero(profile: str) -> None:
    dictionary = DriveBench(profile=profile).drive.dictionary
    present = [place for place in MOTION if place in dictionary]
    assert len(present) >= 7
    assert all(dictionary[place].number > 0 for place in present)


@pytest.mark.parametrize(("machine", "axis"), AXES)
@pytest.mark.parametrize("profile", PROFILES)
def test_a_first_try_in_profile_position_moves_to_the_target(profile: str, machine: str, axis: str) -> None:
    """6060h = 1, 607Ah, 6040h = 06h, 07h, 0Fh, 1Fh, and nothing else."""
    bench = DriveBench(machine, axis, profile)
    bench.enable(POSITION_MODE)
    target = bench.units(3.0)
    bench.write(0x607A, target)
    bench.command(NEW)
    assert status(bench) & ACKNOWLEDGED
    assert not status(bench) & REACHED
    bench.sync(1500)
    assert status(bench) & REACHED
    assert not status(bench) & WARNING
    assert bench.read(0x6064) == pytest.approx(target, abs=bench.units(0.1))
    assert bench.emergencies() == []


@pytest.mark.parametrize(("machine", "axis"), AXES)
@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_a_first_try_of_homing_ends(profile: str, machine: str, axis: str) -> None:
    bench = DriveBench(machine, axis, profile)
    bench.write(0x6098, 17)
    bench.enable(HOMING)
    bench.command(START)
    for _ in range(30_000):
        bench.sync()
        if status(bench) & (ACKNOWLEDGED | 1 << 13):
            break
    assert status(bench) & (ACKNOWLEDGED | 1 << 13) == ACKNOWLEDGED


@pytest.mark.parametrize("mode", [VELOCITY_MODE, PROFILE_VELOCITY, TORQUE_MODE])
def test_a_first_try_of_the_other_modes_is_a_ramp(mode: int) -> None:
    """Not a step: the demand of the second cycle is neither 0 nor the target."""
    bench = DriveBench("scara", "rotate")
    bench.enable(mode)
    target = {VELOCITY_MODE: 200, PROFILE_VELOCITY: bench.units(20.0), TORQUE_MODE: 200}[mode]
    bench.write({VELOCITY_MODE: 0x6042, PROFILE_VELOCITY: 0x60FF, TORQUE_MODE: 0x6071}[mode], target)
    bench.command(0x7F if mode == VELOCITY_MODE else ENABLE)
    bench.sync(2)
    demand = bench.read({VELOCITY_MODE: 0x6043, PROFILE_VELOCITY: 0x606B, TORQUE_MODE: 0x6074}[mode])
    assert 0 < demand < 0.9 * target


def test_what_an_eds_says_goes_before() -> None:
    """dryve_d1 has its own numbers; they are not touched."""
    bench = DriveBench(profile="dryve_d1")
    given = {(entry.index, entry.subindex): entry.default for entry in load_profile("dryve_d1").objects}
    for place in ((0x6081, 0), (0x6083, 0), (0x6084, 0), (0x6085, 0), (0x6099, 1), (0x6099, 2), (0x609A, 0)):
        assert bench.drive.dictionary[place].value == given[place]


@pytest.mark.parametrize("profile", PROFILES)
def test_a_move_that_cannot_start_says_so_and_starts_once_it_can(profile: str) -> None:
    """6081h = 0: acknowledged, a warning (bit 7), not reached; a profile velocity that is written later starts it."""
    bench = DriveBench("scara", "rotate", profile)
    bench.write(0x6081, 0)
    bench.enable(POSITION_MODE)
    start = bench.joint
    target = bench.units(10.0)
    bench.write(0x607A, target)
    bench.command(NEW)
    bench.sync(500)
    assert bench.joint == pytest.approx(start, abs=1e-4)
    assert status(bench) & (ACKNOWLEDGED | REACHED | WARNING) == ACKNOWLEDGED | WARNING
    bench.write(0x6081, bench.units(20.0))
    bench.sync(2)
    assert not status(bench) & (WARNING | REACHED)
    bench.sync(3000)
    assert status(bench) & (REACHED | WARNING) == REACHED
    assert bench.read(0x6064) == pytest.approx(target, abs=bench.units(0.1))


def test_a_speed_limit_of_next_to_nothing_is_no_target_reached() -> None:
    """607Fh = 1 increment a second: on its way for ever, and not there."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x607F, 1)
    bench.enable(POSITION_MODE)
    bench.write(0x607A, bench.units(10.0))
    bench.command(NEW)
    bench.sync(1000)
    assert not status(bench) & REACHED


def test_a_set_point_without_speed_that_waits_says_so_in_its_turn() -> None:
    """Set of set-points: the second one is accepted with 6081h = 0."""
    bench = DriveBench("scara", "rotate")
    bench.enable(POSITION_MODE)
    bench.write(0x607A, bench.units(2.0))
    bench.command(NEW, ENABLE)
    bench.write(0x6081, 0)
    bench.write(0x607A, bench.units(4.0))
    bench.command(NEW, ENABLE)
    bench.sync(2000)
    assert bench.read(0x6064) == pytest.approx(bench.units(2.0), abs=bench.units(0.1))
    assert status(bench) & (REACHED | WARNING) == WARNING
    bench.write(0x6081, bench.units(20.0))
    bench.sync(2000)
    assert status(bench) & (REACHED | WARNING) == REACHED
    assert bench.read(0x6064) == pytest.approx(bench.units(4.0), abs=bench.units(0.1))


def test_a_homing_without_speed_says_so() -> None:
    """6099h = 0: in progress for ever, with a warning."""
    bench = DriveBench("scara", "rotate")
    bench.write(0x6098, 17)
    bench.write(0x6099, 0, 1)
    bench.enable(HOMING)
    bench.command(START)
    bench.sync(100)
    assert status(bench) & (WARNING | REACHED | ACKNOWLEDGED) == WARNING
    bench.write(0x6099, bench.units(10.0), 1)
    bench.sync(2)
    assert not status(bench) & WARNING
