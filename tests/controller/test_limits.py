"""What a limits file allows, and that it only ever narrows."""

from __future__ import annotations

from pathlib import Path

import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.limits import Limits, apply_torque_limits, read_limits, within
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import enable_streaming, home, stream
from drivetwin.controller.trajectory import move
from drivetwin.foundation.errors import UserError
from drivetwin.motion.limits_file import Bounds

STAGE = load_machine("stage")


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "limits.yaml"
    path.write_text(text)
    return path


def stage_limits(travel: tuple[float, float], speed: float, torque: float) -> Limits:
    return Limits(axes={"slide": Bounds(travel=travel, speed=speed, torque=torque)})


def test_a_good_file(tmp_path: Path) -> None:
    path = written(tmp_path, "axes: {slide: {travel: [-0.1, 0.05], speed: 0.1, torque: 50}}")
    assert read_limits(path, STAGE) == stage_limits((-0.1, 0.05), 0.1, 50.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("axes: {slide: {travel: [-0.1, 0.05], speed: 0.1}}", "axes.slide.torque: Field required"),
        ("axes: {slide: {travel: [-0.1], speed: 0.1, torque: 50}}", "axes.slide.travel"),
        ("axes: {slide: {travel: [-0.1, .nan], speed: 0.1, torque: 50}}", "axes.slide.travel.1: .*finite"),
        ("axes: {slide: {travel: [-.inf, .inf], speed: 0.1, torque: 50}}", "axes.slide.travel.0: .*finite"),
        ("axes: {slide: {travel: [-0.1, 0.1], speed: .inf, torque: 50}}", "axes.slide.speed: .*finite"),
        ("axes: {slide: {travel: [-0.1, 0.1], speed: 0, torque: 50}}", "axes.slide.speed: .*greater than 0"),
        ("axes: {slide: {travel: [-0.1, 0.1], speed: 0.1, torque: -50}}", "axes.slide.torque: .*greater than 0"),
        (
            "axes: {slide: {travel: [-0.1, 0.1], speed: 0.1, torque: 50, colour: red}}",
            "slide.colour: is not a known key; there are acceleration, jerk, speed, torque, travel",
        ),
        ("axes: {lift: {travel: [-0.1, 0.1], speed: 0.1, torque: 50}}", "axes: limits of lift, and the machine has slide"),
        ("- 1", "is not a mapping of keys"),
        ("", "is not a mapping of keys"),
        ("axes: {slide: {travel: [0.1, -0.1], speed: 0.1, torque: 50}}", r"axes.slide.travel: expected \[lowest, highest\]"),
        ("axes: {slide: ][", "is not YAML"),
    ],
)
def test_what_a_limits_file_is_refused_for(tmp_path: Path, text: str, expected: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(UserError, match=expected) as refusal:
        read_limits(path, STAGE)
    assert str(path) in str(refusal.value)


def test_no_file_and_a_directory(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"absent\.yaml does not exist"):
        read_limits(tmp_path / "absent.yaml", STAGE)
    with pytest.raises(UserError, match="cannot read"):
        read_limits(tmp_path, STAGE)


def test_limits_narrow_travel_and_every_speed() -> None:
    slide = within(STAGE, stage_limits((-0.1, 0.05), 0.005, 50.0)).axes["slide"]
    assert slide.travel == (-0.1, 0.05)
    assert slide.max_speed == 0.005
    assert slide.homing.search_speed == 0.005
    assert slide.homing.edge_speed == 0.005


def test_limits_never_widen() -> None:
    assert within(STAGE, stage_limits((-9.0, 9.0), 9.0, 1e9)) == STAGE


@pytest.mark.parametrize("travel", [(0.01, 0.1), (-0.1, -0.01), (0.1, -0.1)])
def test_a_travel_without_the_rest_position_is_refused(travel: tuple[float, float]) -> None:
    with pytest.raises(UserError, match="leaves out its rest position"):
        within(STAGE, stage_limits(travel, 0.1, 50.0))


def test_the_torque_limit_reaches_the_drive_and_holds_the_motor() -> None:
    bench = VirtualBench().up()
    (drive,) = bench.drives
    rated_force = drive.joint_torque(float(drive.read(0x6076)) * 1e-3)
    allowed = 0.1 * rated_force
    apply_torque_limits(bench.drives, stage_limits((-0.1, 0.1), 0.1, allowed))
    assert drive.read(0x6072) in (99, 100)
    drive.write_role("following_error_limit", 0)  # the axis will lag for want of force, and nobody minds
    drive.following_error_limit = None
    home(bench.cycle, bench.drives)
    enable_streaming(bench.cycle, bench.drives)
    start = drive.setpoint * drive.unit
    path = move(start, start + 0.1, 0.25, 2.0, bench.cycle.period)
    samples = stream(bench.cycle, bench.drives, path[:, None])
    measured = abs(samples.torque).max()
    noise = 0.02 * rated_force
    assert 0.9 * allowed < measured < allowed + noise


def test_a_generous_torque_limit_does_not_raise_the_drives_own() -> None:
    bench = VirtualBench().up()
    (drive,) = bench.drives
    commissioned = drive.read(0x6072)
    apply_torque_limits(bench.drives, stage_limits((-0.1, 0.1), 0.1, 1e6))
    assert drive.read(0x6072) == commissioned
