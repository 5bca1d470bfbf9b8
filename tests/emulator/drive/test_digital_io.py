"""Digital inputs and outputs, touch probe, DC link, currents (CiA 402-2), against the plant's true positions."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, pi

import pytest
from drive_bench import PROFILE_VELOCITY, DriveBench

from drivetwin.emulator.canopen.abort_codes import AbortCode, SdoAbort
from drivetwin.emulator.drive.digital_io import BRAKE, DigitalOutputs
from drivetwin.emulator.drive.hardware import ALWAYS, NEVER, LimitSwitches, Switch
from drivetwin.emulator.drive.servo import SERVO_PERIOD, Loop

PROFILE_TORQUE = 4
NO_CREEP = 1e-6
SPEED = 20.0
PERIOD = SPEED * SERVO_PERIOD * 1.3
"""The way of one servo period [rad]."""


def moving(profile: str = "cia402-full") -> DriveBench:
    bench = DriveBench(profile=profile)
    bench.write(0x6083, bench.units(500.0))
    bench.write(0x6084, bench.units(500.0))
    bench.write(0x60FF, bench.units(SPEED))
    bench.enable(PROFILE_VELOCITY)
    bench.sync(100)
    return bench


def zone(bench: DriveBench, ahead: float, width: float) -> Switch:
    """A probe signal that begins `ahead` of the motor [rad]."""
    start = bench.motor + ahead
    return Switch(start, start + width)


def told(bench: DriveBench, index: int) -> float:
    """Motor angle [rad] of a latched position."""
    return bench.read(index) / bench.units(1.0) + bench.drive.axis.scaling.origin


def test_digital_inputs() -> None:
    bench = DriveBench()
    hardware = bench.drive.hardware
    assert bench.read(0x60FD) == 0
    disturbances: tuple[Callable[[], None], ...] = (
        lambda: setattr(hardware, "switches", LimitSwitches(1e9, 1e9)),
        lambda: setattr(hardware, "switches", LimitSwitches(-1e9, -1e9)),
        lambda: setattr(hardware, "home_switch", ALWAYS),
        lambda: setattr(hardware, "sto", True),
    )
    for bit, disturb in enumerate(disturbances):
        disturb()
        assert int(bench.read(0x60FD)) >> bit & 1
    hardware.home_switch = None
    assert not int(bench.read(0x60FD)) >> 2 & 1


def test_digital_outputs() -> None:
    """60FEh:01 under the mask 60FEh:02, where the drive has one."""
    full, servoone = DriveBench(), DriveBench(profile="servoone")
    outputs = DigitalOutputs(full.drive.axis)
    full.write(0x60FE, 0xF0F0, 1)
    assert outputs.on() == 0
    full.write(0x60FE, 0xFF00, 2)
    assert outputs.on() == 0xF000
    servoone.write(0x60FE, 0xF0F0, 1)
    assert DigitalOutputs(servoone.drive.axis).on() == 0xF0F0


VERTICAL = [("scara", "lift"), ("arm", "shoulder")]


def without_torque(machine: str, axis: str, output: int, mask: int) -> DriveBench:
    """Operation enabled in profile torque mode with target 0: nothing but the brake can hold the axis."""
    bench = DriveBench(machine, axis)
    bench.write(0x60FE, output, 1)
    bench.write(0x60FE, mask, 2)
    bench.enable(PROFILE_TORQUE)
    assert bench.drive.axis.servo.loop is Loop.TORQUE
    return bench


@pytest.mark.parametrize(("machine", "axis"), VERTICAL)
def test_a_brake_that_is_set_holds_an_enabled_axis(machine: str, axis: str) -> None:
    """60FEh bit 0: it holds while the motor gives nothing, and the axis falls when it is taken back."""
    bench = without_torque(machine, axis, BRAKE, BRAKE)
    start = bench.joint
    bench.sync(1000)
    assert abs(bench.joint - start) < NO_CREEP
    assert bench.read(0x6074) == 0
    bench.write(0x60FE, 0, 1)
    bench.sync(300)
    assert abs(bench.joint - start) > 0.01
    bench.write(0x60FE, BRAKE, 1)
    bench.sync(300)
    stopped = bench.joint
    bench.sync(300)
    assert abs(bench.joint - stopped) < NO_CREEP


@pytest.mark.parametrize(("output", "mask"), [(0, BRAKE), (BRAKE, 0), (BRAKE, 0xFFFF_FFFE), (0xFFFF_FFFE, BRAKE)])
@pytest.mark.parametrize(("machine", "axis"), VERTICAL)
def test_a_brake_that_is_not_set_holds_nothing(machine: str, axis: str, output: int, mask: int) -> None:
    bench = without_torque(machine, axis, output, mask)
    start = bench.joint
    bench.sync(300)
    assert abs(bench.joint - start) > 0.01


def test_a_brake_holds_up_to_its_torque() -> None:
    """The arm's has 0.6 N·m on the motor: with 7.8 N·m of weight and 2.2 N·m of stiction behind 1:100 it slips at 0.7."""
    bench = without_torque("arm", "shoulder", BRAKE, BRAKE)
    bench.write(0x6087, 0)
    start = bench.joint
    for torque, moves in ((0.5, False), (-0.5, False), (0.9, True)):
        bench.write(0x6071, round(1000.0 * torque / 0.4))
        bench.sync(300)
        assert (abs(bench.joint - start) > 0.01) is moves, torque


def test_a_brake_of_a_drive_without_a_mask_needs_none() -> None:
    """A ServoOne has no 60FEh:02. Its velocity loop pulls at the lift's brake with all that 6072h allows, and is let go."""
    bench = DriveBench("scara", "lift", "servoone")
    bench.write(0x60FE, BRAKE, 1)
    bench.write(0x60FF, bench.units(3.0))
    bench.write(0x6083, bench.units(100.0))
    bench.write(0x6072, 1500)
    bench.enable(PROFILE_VELOCITY)
    start = bench.joint
    bench.sync(1000)
    assert bench.read(0x6074) == 1500
    assert abs(bench.joint - start) < NO_CREEP
    bench.write(0x60FE, 0, 1)
    bench.sync(500)
    assert bench.joint_velocity * bench.configuration.gear_ratio == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
@pytest.mark.parametrize("probe", [0, 1])
def test_touch_probe_latches_both_edges_once(profile: str, probe: int) -> None:
    """Single: the first edge of each kind is kept until the probe is enabled anew; caught at the servo period."""
    bench = moving(profile)
    positive, negative = ((0x60BA, 0x60BB), (0x60BC, 0x60BD))[probe]
    shift = 8 * probe
    first = zone(bench, 2.0, 1.0)
    bench.drive.hardware.probes[probe] = first
    bench.write(0x60B8, 0x31 << shift)
    bench.sync()
    assert bench.read(0x60B9) == 0x01 << shift
    bench.sync(300)
    assert bench.read(0x60B9) == 0x07 << shift
    assert 0.0 <= told(bench, positive) - first.low <= PERIOD
    assert 0.0 <= told(bench, negative) - first.high <= PERIOD
    kept = bench.read(positive)
    bench.drive.hardware.probes[probe] = NEVER
    bench.sync()
    bench.drive.hardware.probes[probe] = zone(bench, 2.0, 1.0)
    bench.sync(300)
    assert bench.read(positive) == kept
    bench.write(0x60B8, 0)
    bench.sync()
    assert bench.read(0x60B9) == 0


@pytest.mark.parametrize(("function", "status"), [(0x11, 0x03), (0x21, 0x05)])
def test_touch_probe_of_one_edge(function: int, status: int) -> None:
    bench = moving()
    bench.drive.hardware.probes[0] = zone(bench, 2.0, 1.0)
    bench.write(0x60B8, function)
    bench.sync(300)
    assert bench.read(0x60B9) == status


def test_touch_probe_goes_on_latching() -> None:
    """Continuous: the last edge counts."""
    bench = moving()
    bench.write(0x60B8, 0x13)
    for _ in range(3):
        bench.drive.hardware.probes[0] = NEVER
        bench.sync(2)
        signal = zone(bench, 2.0, 1.0)
        bench.drive.hardware.probes[0] = signal
        bench.sync(200)
        assert 0.0 <= told(bench, 0x60BA) - signal.low <= PERIOD


def test_touch_probe_on_the_zero_impulse() -> None:
    bench = moving()
    bench.drive.hardware.index_angle = 1.0
    bench.write(0x60B8, 0x15)
    bench.sync()
    pulse = 2.0 * pi * ceil((bench.motor - 1.0) / (2.0 * pi)) + 1.0
    bench.sync(600)
    assert 0.0 <= told(bench, 0x60BA) - pulse <= PERIOD


def test_an_actuated_probe_is_no_edge_when_enabled() -> None:
    bench = moving()
    bench.drive.hardware.probes[0] = ALWAYS
    bench.write(0x60B8, 0x31)
    bench.sync(50)
    assert bench.read(0x60B9) == 0x01


def test_currents() -> None:
    """6078h in thousandths of 6075h is the torque in thousandths of 6076h, as torque is proportional to current."""
    bench = moving()
    assert bench.read(0x6075) == 2000
    for _ in range(20):
        bench.sync()
        assert bench.read(0x6078) == bench.read(0x6077)


@pytest.mark.parametrize("source", [2, 3])
@pytest.mark.parametrize("shift", [0, 8])
@pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
def test_a_touch_probe_source_that_is_not_there_is_refused(profile: str, shift: int, source: int) -> None:
    """CiA 402-2, 60B8h bits 2, 3 and 10, 11: 2 is the source of 60D0h, which the drive has not, 3 is reserved."""
    bench = DriveBench(profile=profile)
    with pytest.raises(SdoAbort) as refused:
        bench.write(0x60B8, (0x11 | source << 2) << shift)
    assert refused.value.code == AbortCode.INVALID_VALUE
    bench.write(0x60B8, 0x15 << shift)
