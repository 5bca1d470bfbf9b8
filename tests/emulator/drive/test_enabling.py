"""Enabling: no jump in any mode, the brake before it, and which modes there are (CiA 402-2, 'Modes of operation')."""

from __future__ import annotations

import pytest
from drive_bench import CYCLIC, DISABLE_VOLTAGE, ENABLE, HOMING, INTERPOLATED, PROFILE_VELOCITY, SHUTDOWN, SWITCH_ON, DriveBench

from drivetwin.emulator.canopen import SdoAbort
from drivetwin.emulator.drive.state_machine import State

AXES = [("scara", "lift"), ("scara", "rotate"), ("scara", "stretch"), ("stage", "slide"), ("arm", "shoulder")]


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
