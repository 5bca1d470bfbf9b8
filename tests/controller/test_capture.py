"""What is captured is what the contract says, as its own reader judges it."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.capture import describe, position_demand, record
from drivetwin.controller.machine import POSITION_UNIT, load_machine
from drivetwin.controller.motion import Samples, enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.procedure import Captured, capture_machine
from drivetwin.controller.progress import Progress
from drivetwin.controller.trajectory import move
from drivetwin.recording.reader import check_joints, read_recording
from drivetwin.recording.writer import write_recording


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_drives_are_described_as_they_were_commissioned(profile: str) -> None:
    bench = VirtualBench("scara", profile).up()
    described = describe(bench.drives)
    for name, axis in bench.virtual.machine.axes.items():
        info, loops = described[name], axis.loops
        assert info.gear_ratio == pytest.approx(axis.gear_ratio)
        assert info.rated_torque == pytest.approx(axis.motor.rated_torque * axis.gear_ratio, rel=1e-3)
        resolution = 2.0 * pi / axis.encoder.increments_per_revolution / axis.gear_ratio
        assert info.position_resolution == pytest.approx(max(resolution, POSITION_UNIT))
        drive = info.drive
        assert drive is not None
        assert drive.position_gain == pytest.approx(loops.position_gain, rel=1e-3)
        assert drive.velocity_gain == pytest.approx(loops.velocity_gain, rel=1e-3)
        assert drive.integral_time == pytest.approx(loops.integral_time, rel=1e-3)
        assert drive.velocity_feedforward == pytest.approx(loops.velocity_feedforward, rel=1e-3)
        assert drive.velocity_filter_hz == pytest.approx(loops.velocity_filter_hz, rel=1e-3)
        assert drive.servo_period == pytest.approx(125e-6)
        assert drive.torque_limit == pytest.approx(axis.motor.peak_torque * axis.gear_ratio, rel=1e-3)
        assert drive.interpolation == "cubic_spline"


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_the_position_demand_is_what_6062h_was_at_each_sync(profile: str) -> None:
    """Beside the drive's own, looked at from inside, to the rounding of a set-point."""
    bench = VirtualBench("arm", profile).up()
    home(bench.cycle, bench.drives)
    enable_streaming(bench.cycle, bench.drives)
    start = positions_now(bench.drives)
    path = move(float(start[0]), 0.0, 1.0, 8.0, bench.cycle.period)[:, None]
    state, gear = bench.virtual.drives[0].axis.servo.state, bench.drives[0].axis.gear_ratio
    origin = bench.virtual.drives[0].axis.scaling.origin
    inside: list[float] = []
    bench.before_sync = lambda: inside.append((float(state["position_demand"]) - origin) / gear)
    stream(bench.cycle, bench.drives, path)
    shown = position_demand(bench.drives, start, path)
    np.testing.assert_allclose(shown[:, 0], inside, rtol=0.0, atol=2e-8)
    late = np.abs(path[2:, 0] - inside[2:]).max()
    assert late > 100.0 * np.abs(shown[:, 0] - inside).max()


def test_a_captured_move_is_a_recording(tmp_path: Path) -> None:
    bench = VirtualBench().up()
    axes = describe(bench.drives)
    home(bench.cycle, bench.drives)
    enable_streaming(bench.cycle, bench.drives)
    path = move(float(positions_now(bench.drives)[0]), 0.0, 0.2, 1.0, bench.cycle.period)[:, None]
    samples = stream(bench.cycle, bench.drives, path)
    demand = position_demand(bench.drives, path[0], path)
    write_recording(record("run", "stage", 0.001, axes, demand, samples), tmp_path / "run", seed=0, inputs=[])
    (read,) = read_recording(tmp_path / "run")
    check_joints(read, {"slide"})
    assert read.info.sample_period == 0.001
    assert read.info.axes["slide"].actuator == "slide"
    np.testing.assert_array_equal(read.columns["slide"]["position_demand"], demand[:, 0])
    np.testing.assert_array_equal(read.columns["slide"]["torque"], samples.torque[:, 0])
    # the force accelerates towards positive positions: it does work against friction on a way up
    work = float(np.sum(read.columns["slide"]["torque"][1:] * np.diff(read.columns["slide"]["position"])))
    assert path[-1, 0] > path[0, 0]
    assert work > 0.0


def test_the_resolution_is_that_of_the_values() -> None:
    axes = describe(VirtualBench().up().drives)
    quantum = 0.37
    steps = np.random.default_rng(0).integers(-50, 50, 400).astype(np.float64)
    samples = Samples(position=np.zeros((400, 1)), torque=quantum * steps[:, None])
    found = record("x", "stage", 0.001, axes, np.zeros((400, 1)), samples).info.axes["slide"].torque_resolution
    assert found == pytest.approx(quantum)
    flat = Samples(position=np.zeros((400, 1)), torque=np.zeros((400, 1)))
    assert record("x", "stage", 0.001, axes, np.zeros((400, 1)), flat).info.axes["slide"].torque_resolution is None


def captured(tmp_path: Path, seed: int) -> tuple[Captured, bytes]:
    bench = VirtualBench("arm", seed=seed)
    log = tmp_path / "bus.log"
    result = capture_machine(bench.bus, load_machine("arm"), bench.profile, Lockstep(), None, seed, Progress(), log)
    return result, log.read_bytes()


def test_two_runs_are_bit_identical(tmp_path: Path) -> None:
    first, first_log = captured(tmp_path, 5)
    again, again_log = captured(tmp_path, 5)
    assert first_log == again_log
    assert [recording.name for recording in first.recordings] == ["strokes_shoulder", "excitation_shoulder"]
    for one, two in zip(first.recordings, again.recordings, strict=True):
        for column, values in one.columns["shoulder"].items():
            np.testing.assert_array_equal(values, two.columns["shoulder"][column])
    assert first.sdo_points == again.sdo_points
