"""60B1h streamed in RPDO 2: mapped as asked, converted to the drive's units, and as good as the drive's own feed-forward."""

from __future__ import annotations

import numpy as np
import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.motion import Offsets, enable_streaming, positions_now, stream
from drivetwin.controller.trajectory import stroke

CYCLE = 0.002
SPEED, WAY, ACCELERATION = 0.8, 0.8, 6.0
PROFILES = ["servoone", "cia402-full"]


def bench_with(profile: str, takes_velocity_offset: bool) -> VirtualBench:
    """The arm at 2 ms, its drive enabled; RPDO 2 carries 60B1h or is off."""
    bench = VirtualBench("arm", profile)
    bench.cycle.period = CYCLE
    bench.drives[0].takes_velocity_offset = takes_velocity_offset
    bench.up()
    enable_streaming(bench.cycle, bench.drives)
    bench.cycle.run_for(0.3)
    return bench


def feed_forward_by_itself(drive: DriveNode, share: float) -> None:
    role = drive.role("velocity_feedforward")
    assert role is not None
    drive.write(share / role.si_per_unit, role.index, role.subindex)


def following(bench: VirtualBench, own: float, offset: bool) -> tuple[float, float]:
    """Following error in the cruise of a stroke [rad], from inside: its mean and its greatest magnitude in the whole stroke."""
    feed_forward_by_itself(bench.drives[0], own)
    start = float(positions_now(bench.drives)[0])
    path = stroke(start, start + WAY, SPEED, ACCELERATION, CYCLE)
    late = bench.drives[0].setpoint_delay
    speed = np.gradient(np.concatenate([np.full(late, start), path[:-late]]), CYCLE)
    state, gear = bench.virtual.drives[0].axis.servo.state, bench.drives[0].axis.gear_ratio
    seen: list[float] = []
    bench.before_sync = lambda: seen.append(float(state["following_error"]) / gear)
    stream(
        bench.cycle,
        bench.drives,
        path[:, None],
        Offsets(np.zeros((len(path), 1)), speed[:, None] if offset else None),
    )
    bench.before_sync = None
    cruise = slice(round(0.5 * len(path)), round(0.65 * len(path)))
    return float(np.mean(seen[cruise])), float(np.abs(seen).max())


@pytest.mark.parametrize("profile", PROFILES)
def test_rpdo_2_carries_the_velocity_offset(profile: str) -> None:
    bench = bench_with(profile, True)
    dictionary = bench.virtual.drives[0].dictionary
    assert [dictionary[0x1601, entry].value for entry in range(2)] == [1, 0x60B10020]
    assert dictionary[0x1401, 2].value == 1, "at each SYNC"
    assert dictionary[0x1401, 1].value == 0x301, "valid, its predefined COB-ID"
    assert bench.virtual.cycle() == pytest.approx(CYCLE)
    bench.drives[0].velocity_offset = -123456
    bench.cycle.run()
    assert dictionary[0x60B1].value == -123456


@pytest.mark.parametrize("profile", PROFILES)
def test_without_a_velocity_offset_rpdo_2_is_off(profile: str) -> None:
    bench = bench_with(profile, True)
    bench.drives[0].takes_velocity_offset = False
    bench.link.cycle = None  # nobody supervises PDOs that are being mapped
    bench.drives[0].map_pdos()
    bench.cycle.start()
    assert int(bench.virtual.drives[0].dictionary[0x1401, 1].value) & 1 << 31
    bench.sent.clear()
    bench.cycle.run()
    assert 0x301 not in [frame.arbitration_id for frame in bench.sent]


@pytest.mark.parametrize("profile", PROFILES)
def test_the_loops_get_the_joint_s_speed_through_the_gear(profile: str) -> None:
    """0.3 rad/s of the joint is 30 rad/s of the motor behind 1:100."""
    bench = bench_with(profile, True)
    drive, servo = bench.drives[0], bench.virtual.drives[0].axis.servo
    feed_forward_by_itself(drive, 0.0)
    standing = np.tile(positions_now(bench.drives), (2, 1))
    stream(bench.cycle, bench.drives, standing, Offsets(np.zeros((2, 1)), np.full((2, 1), 0.3)))
    np.testing.assert_allclose(servo.demand[:, 2], 0.3 * drive.axis.gear_ratio, rtol=1e-6)
    drive.clear_offsets()
    bench.cycle.run()
    np.testing.assert_array_equal(servo.demand[:, 2], 0.0)


@pytest.mark.parametrize("profile", PROFILES)
def test_streamed_it_is_as_good_as_the_drive_s_own(profile: str) -> None:
    """A PI velocity loop: v / Kp without any; next to none in the cruise with either, and as much as the other all along."""
    bench = bench_with(profile, True)
    gain = bench.virtual.machine.axes["shoulder"].loops.position_gain
    without, _ = following(bench, own=0.0, offset=False)
    assert without == pytest.approx(SPEED / gain, rel=0.02)
    fresh = bench_with(profile, True)
    by_itself, most_by_itself = following(fresh, own=1.0, offset=False)
    again = bench_with(profile, True)
    streamed, most_streamed = following(again, own=0.0, offset=True)
    assert abs(by_itself) < 0.02 * SPEED / gain
    assert abs(streamed) < 0.02 * SPEED / gain
    assert most_streamed < 1.1 * most_by_itself
    twice, _ = following(bench_with(profile, True), own=1.0, offset=True)
    assert twice == pytest.approx(-SPEED / gain, rel=0.05), "both at once drive it ahead by as much"
