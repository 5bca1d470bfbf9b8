"""6007h: what an enabled drive does when its master is lost, by every event that CiA 402-2 names; and P2061 of a ServoOne."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from drive_bench import CYCLE, PROFILE_VELOCITY, DriveBench

from drivetwin.emulator.canopen import SdoAbort
from drivetwin.emulator.drive.servo import Loop
from drivetwin.emulator.drive.state_machine import State
from drivetwin.emulator.drive.stops import STANDSTILL
from drivetwin.emulator.faults.frames_lost import FramesLost

SPEED, RAMP = 20.0, 400.0
MASTER = 0x77
NOTHING, FAULT, DISABLE_VOLTAGE, QUICK_STOP = range(4)
NO_CHANGE = 1
"""1029h:01: the NMT state stays."""


def moving(profile: str = "cia402-full") -> DriveBench:
    bench = DriveBench(profile=profile)
    for index, value in ((0x6083, RAMP), (0x6084, RAMP), (0x6085, RAMP), (0x60FF, SPEED)):
        bench.write(index, bench.units(value))
    bench.enable(PROFILE_VELOCITY)
    bench.sync(200)
    return bench


def nmt(bench: DriveBench, command: int) -> None:
    bench.drive.device.receive(0, bytes((command, bench.configuration.node_id)))


def miss_heartbeat(bench: DriveBench) -> None:
    bench.write(0x1016, MASTER << 16 | 5, 1)
    bench.drive.device.receive(0x700 + MASTER, b"\x05")
    bench.sync(6)


def miss_guarding(bench: DriveBench) -> None:
    bench.write(0x100C, 2)
    bench.write(0x100D, 3)
    bench.drive.device.receive(0x700 + bench.configuration.node_id, b"", remote=True)
    bench.sync(7)


def bus_off(bench: DriveBench) -> None:
    bench.virtual.wires[bench.index].bus_off()


def stop_node(bench: DriveBench) -> None:
    nmt(bench, 0x02)


def reset_communication(bench: DriveBench) -> None:
    nmt(bench, 0x82)


Event = Callable[[DriveBench], None]
EVENTS = [
    (miss_heartbeat, 0x8130),
    (miss_guarding, 0x8130),
    (bus_off, 0x8100),
    (stop_node, 0x8100),
    (reset_communication, 0x8100),
]


def test_the_default_is_a_fault() -> None:
    assert DriveBench().read(0x6007) == FAULT


@pytest.mark.parametrize(("event", "code"), EVENTS)
def test_lost_master_is_a_fault(event: Event, code: int) -> None:
    """6007h = 1: the fault reaction of 605Eh with the event's error code, then fault."""
    bench = moving()
    event(bench)
    assert (bench.state, bench.read(0x603F)) == (State.FAULT_REACTION_ACTIVE, code)
    assert int(bench.read(0x1001)) & 0x11 == 0x11
    bench.sync(200)
    stopped = bench.state
    assert stopped is State.FAULT
    assert abs(bench.joint_velocity) * bench.configuration.gear_ratio < STANDSTILL
    bench.command(0x80)
    assert bench.state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize("event", [event for event, _ in EVENTS])
def test_lost_master_is_nothing(event: Event) -> None:
    bench = moving()
    bench.write(0x6007, NOTHING)
    event(bench)
    bench.sync(50)
    assert bench.state is State.OPERATION_ENABLED
    assert bench.joint_velocity > 0.0


@pytest.mark.parametrize("event", [event for event, _ in EVENTS])
def test_lost_master_disables_voltage(event: Event) -> None:
    bench = moving()
    bench.write(0x6007, DISABLE_VOLTAGE)
    event(bench)
    bench.sync()
    assert bench.state is State.SWITCH_ON_DISABLED
    assert bench.drive.axis.servo.loop is Loop.OFF


@pytest.mark.parametrize("event", [event for event, _ in EVENTS])
def test_lost_master_quick_stops(event: Event) -> None:
    """As 605Ah says: here by 6085h, and stay."""
    bench = moving()
    bench.write(0x6007, QUICK_STOP)
    bench.write(0x605A, 6)
    event(bench)
    assert bench.state is State.QUICK_STOP_ACTIVE
    bench.sync(round(SPEED / RAMP / CYCLE) + 150)
    assert bench.state is State.QUICK_STOP_ACTIVE
    assert abs(bench.joint_velocity) * bench.configuration.gear_ratio < STANDSTILL
    assert bench.drive.axis.servo.loop is Loop.POSITION


@pytest.mark.parametrize("event", [event for event, _ in EVENTS])
@pytest.mark.parametrize("option", [FAULT, DISABLE_VOLTAGE, QUICK_STOP])
def test_a_drive_that_is_not_enabled_has_nothing_to_abort(event: Event, option: int) -> None:
    bench = DriveBench()
    bench.write(0x6007, option)
    bench.command(0x06, 0x07)
    event(bench)
    assert bench.state is State.SWITCHED_ON


def test_one_emergency_for_one_lost_heartbeat() -> None:
    bench = moving()
    bench.write(0x1029, NO_CHANGE, 1)
    miss_heartbeat(bench)
    bench.sync(200)
    assert bench.emergencies() == [0x8130]


def test_the_drive_without_6007h_goes_on() -> None:
    bench = moving("servoone")
    stop_node(bench)
    bench.sync(20)
    assert bench.state is State.OPERATION_ENABLED


def lose_syncs(bench: DriveBench, cycles: int) -> None:
    """SYNC moves the machine's time on, but does not reach the drive."""
    silence = FramesLost(node=bench.configuration.node_id, direction="received")
    silence.strike(bench.virtual)
    bench.sync(cycles)
    silence.end(bench.virtual)


def test_can_timeout_of_a_servoone() -> None:
    """280Dh = 1: a fault when 280Eh = 10 ms have gone by without SYNC, not before."""
    bench = moving("servoone")
    bench.write(0x280D, 1)
    bench.write(0x280E, 10)
    bench.sync(50)
    lose_syncs(bench, 8)
    bench.sync(5)
    assert (bench.state, bench.emergencies()) == (State.OPERATION_ENABLED, [])
    lose_syncs(bench, 11)
    assert bench.state is State.FAULT_REACTION_ACTIVE
    assert bench.emergencies() == [0x8100]


@pytest.mark.parametrize(("kind", "time"), [(0, 10), (1, 0)])
def test_can_timeout_that_is_off(kind: int, time: int) -> None:
    bench = moving("servoone")
    bench.write(0x280D, kind)
    bench.write(0x280E, time)
    bench.sync(5)
    lose_syncs(bench, 100)
    assert bench.state is State.OPERATION_ENABLED


def test_can_timeout_type_that_is_not_known_is_refused() -> None:
    with pytest.raises(SdoAbort):
        DriveBench(profile="servoone").write(0x280D, 2)
