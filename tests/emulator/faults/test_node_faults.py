"""Drives that restart, die, come back as another, or lose their supply: what a master sees, and what the axes do."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from fault_bench import (
    ENABLED,
    HEARTBEAT,
    LIFT,
    NODES,
    PROFILE_VELOCITY,
    ROTATE,
    STRETCH,
    SWITCH_ON_DISABLED,
    FaultBench,
    moving,
)

from drivetwin.emulator.canopen.parameter_store import ParameterStore
from drivetwin.emulator.effects import PlacedEffect, library
from drivetwin.emulator.modbus.service import ModbusService
from drivetwin.foundation.errors import UserError

BOOT_UP = bytes(1)


def silent(bench: FaultBench, node: int, cycles: int) -> bool:
    """Whether nothing of a node is on the bus in some cycles, whatever is asked."""
    bench.take()
    bench.send(0x600 + node, bytes.fromhex("40 00 10 00 00 00 00 00"))
    bench.send(0x7E5, bytes.fromhex("04 01 00 00 00 00 00 00"))
    bench.send(0x7E5, bytes.fromhex("5E 00 00 00 00 00 00 00"))
    bench.sync(cycles)
    return not [frame for frame in bench.sent if frame.arbitration_id & 0x7F == node and frame.arbitration_id >= 0x80]


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_a_node_resets_while_its_axis_moves(profile: str) -> None:
    """Off for 20 ms, then boot-up, pre-operational, no torque; parameters and heartbeat are those of power-on."""
    bench = moving(profile)
    for node in (ROTATE, STRETCH):
        bench.write(node, 0x1017, 5)
    bench.strike("node_resets", node=ROTATE, off=0.02)
    assert silent(bench, ROTATE, 19)
    assert bench.torque(ROTATE) == 0.0
    bench.take()
    bench.sync()
    assert bench.take(HEARTBEAT + ROTATE) == [BOOT_UP]
    bench.sync(20)
    assert bench.take(HEARTBEAT + ROTATE) == []  # 1017h is 0 again
    assert (bench.read(ROTATE, 0x1017), bench.read(STRETCH, 0x1017)) == (0, 5)
    assert bench.state(ROTATE) == SWITCH_ON_DISABLED
    assert bench.read(ROTATE, 0x60FF) == 0
    assert bench.state(STRETCH) == ENABLED
    bench.sync(100)
    assert bench.speed(STRETCH) == pytest.approx(0.5, rel=0.02)


def test_a_node_that_boots_at_once_says_so_at_once() -> None:
    bench = FaultBench()
    bench.strike("node_resets", node=ROTATE, off=0)
    assert bench.take(HEARTBEAT + ROTATE) == [BOOT_UP]


def test_zero_is_where_the_encoder_is_when_it_boots() -> None:
    """The reference is lost: position actual value 0 at power-on, wherever the axis is."""
    bench = moving()
    assert bench.read(ROTATE, 0x6064, signed=True) != 0
    bench.strike("node_resets", node="rotate", off=0.3)
    bench.sync(310)
    assert bench.speed(ROTATE) == pytest.approx(0.0, abs=1e-9)
    assert bench.read(ROTATE, 0x6064, signed=True) == 0


def test_an_axis_without_torque_coasts_to_rest_by_its_friction() -> None:
    """Rotate has no brake: it stops, by friction alone, later than its ramp would."""
    bench = moving("servoone", ROTATE)
    bench.strike("node_dies", node=ROTATE)
    speeds = []
    for _ in range(100):
        bench.sync()
        speeds.append(bench.speed(ROTATE))
    assert all(later <= earlier + 1e-9 for earlier, later in pairwise(speeds))
    assert speeds[5] > 0.1
    assert abs(speeds[-1]) < 1e-6
    assert bench.torque(ROTATE) == 0.0


def test_the_brake_of_a_dead_drive_holds_the_lift() -> None:
    bench = FaultBench()
    bench.start()
    bench.enable(LIFT)
    bench.sync(300)
    held = bench.position(LIFT)
    bench.strike("node_dies", node=LIFT)
    bench.sync(500)
    assert bench.position(LIFT) == pytest.approx(held, abs=1e-5)
    assert bench.torque(LIFT) == 0.0


def test_a_dead_node_is_silent_for_ever_and_the_others_are_not() -> None:
    bench = FaultBench("cia402-full")
    for node in NODES:
        bench.write(node, 0x1017, 1)
    fault = bench.strike("node_dies", node=STRETCH)
    assert silent(bench, STRETCH, 2000)
    assert not silent(bench, ROTATE, 5)
    with pytest.raises(UserError, match="node_dies strikes once and has no end"):
        bench.end(fault)


def test_a_power_cycle_brings_a_dead_node_back() -> None:
    bench = FaultBench()
    bench.strike("node_dies", node=STRETCH)
    bench.sync(10)
    bench.strike("power_cycle", node=STRETCH, off=0.1)
    bench.sync(100)
    assert bench.take(HEARTBEAT + STRETCH) == [BOOT_UP]
    bench.start()
    bench.enable(STRETCH)


def test_what_is_struck_later_counts() -> None:
    """A node that dies while it restarts stays dead, one that is switched off again boots once, after the later time."""
    bench = FaultBench()
    for node in (ROTATE, STRETCH):
        bench.strike("node_resets", node=node, off=0.05)
    bench.sync(20)
    bench.strike("node_dies", node=ROTATE)
    bench.strike("power_cycle", node=STRETCH, off=0.1)
    bench.take()
    bench.sync(99)
    assert bench.sent == []
    bench.sync(100)
    assert [frame.arbitration_id for frame in bench.sent] == [HEARTBEAT + STRETCH]


def test_a_power_cycle_of_the_whole_machine() -> None:
    bench = moving("servoone", *NODES)
    bench.strike("power_cycle", off=0.2)
    assert all(silent(bench, node, 60) for node in NODES)
    bench.take()
    bench.sync(20)
    assert [frame.arbitration_id for frame in bench.sent] == [HEARTBEAT + node for node in NODES]
    assert {bench.state(node) for node in NODES} == {SWITCH_ON_DISABLED}
    assert max(abs(bench.speed(node)) for node in NODES) < 1e-6
    bench.start()
    bench.enable(*NODES)
    bench.move(*NODES)
    assert bench.speed(ROTATE) == pytest.approx(0.5, rel=0.02)


def test_a_power_cycle_keeps_what_is_stored_and_nothing_else(tmp_path: Path) -> None:
    bench = FaultBench("cia402-full", tmp_path)
    bench.write(ROTATE, 0x6083, 1234)
    bench.send(0x600 + ROTATE, bytes.fromhex("23 10 10 01 73 61 76 65"))
    assert bench.take(0x580 + ROTATE) == [bytes.fromhex("60 10 10 01 00 00 00 00")]
    before = bench.read(ROTATE, 0x6084)
    bench.write(ROTATE, 0x6084, 777)
    bench.strike("power_cycle", off=0)
    assert bench.read(ROTATE, 0x6083) == 1234
    assert bench.read(ROTATE, 0x6084) == before


def test_the_world_around_a_drive_stays_as_it_is_in_a_power_cycle() -> None:
    """Safe torque off that is requested stays so."""
    bench = FaultBench()
    fault = bench.strike("sto", node=ROTATE)
    bench.strike("power_cycle", node=ROTATE, off=0)
    bench.write(ROTATE, 0x6040, 0x06)
    bench.write(ROTATE, 0x6040, 0x07)
    bench.sync(2)
    assert bench.state(ROTATE) == 0x08
    bench.end(fault)
    bench.sync()
    bench.write(ROTATE, 0x6040, 0x80)
    assert bench.state(ROTATE) == SWITCH_ON_DISABLED


def test_a_power_cycle_restarts_a_can_controller_that_is_off_the_bus() -> None:
    bench = FaultBench()
    fault = bench.strike("bus_off", node=ROTATE)
    bench.strike("power_cycle", node=ROTATE, off=0)
    assert bench.take(HEARTBEAT + ROTATE) == [BOOT_UP]
    bench.end(fault)
    assert bench.take() == []


def test_the_power_stage_stays_what_it_is_in_a_power_cycle() -> None:
    """A current limit of the plant's truth (`torque_saturation`), against a jam before and after: 10 N·m at the joint."""
    saturation = library()["torque_saturation"](**{"limit": 10.0})
    bench = FaultBench(more=(PlacedEffect("rotate", saturation, {}),))
    bench.start()
    bench.strike("jam", node=ROTATE)
    for _ in range(2):
        bench.enable(ROTATE)
        bench.move(ROTATE)
        bench.sync(300)
        assert abs(bench.torque(ROTATE)) * 50.0 == pytest.approx(10.0, rel=1e-6)
        bench.strike("power_cycle", node=ROTATE, off=0)
        bench.start()


def test_another_id_is_stronger_than_the_one_that_lss_stored(tmp_path: Path) -> None:
    ParameterStore(tmp_path / "rotate.json").configure(ROTATE, 0)
    bench = FaultBench("cia402-full", tmp_path)
    bench.strike("node_changes_id", node=ROTATE, new_id=17, off=0)
    assert bench.take(HEARTBEAT + 17) == [BOOT_UP]


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_a_node_returns_with_another_id(profile: str) -> None:
    bench = FaultBench(profile)
    bench.strike("node_changes_id", node=ROTATE, new_id=17, off=0.01)
    bench.sync(10)
    assert [(frame.arbitration_id, bytes(frame.data)) for frame in bench.sent] == [(HEARTBEAT + 17, BOOT_UP)]
    assert bench.read(ROTATE, 0x1000) is None
    assert bench.read(17, 0x1000) == bench.read(LIFT, 0x1000)
    assert bench.read(17, 0x1014) == 0x80 + 17
    bench.strike("power_cycle", node=ROTATE, off=0)
    assert bench.read(17, 0x1000) is None
    assert bench.read(ROTATE, 0x1000) is not None


def test_a_run_with_restarts_is_repeatable() -> None:
    """And a drive that restarts at rest, before anything was written, leaves the others bit for bit what they were."""
    logs = []
    for _ in range(2):
        bench = moving("servoone", LIFT, ROTATE)
        bench.strike("power_cycle", node=LIFT, off=0.03)
        bench.take()
        bench.position_at_every_sync()
        bench.start()
        bench.sync(200)
        logs.append([(frame.arbitration_id, bytes(frame.data), frame.timestamp) for frame in bench.sent])
    assert logs[0] == logs[1]
    assert len(logs[0]) > 400


def test_modbus_asks_the_drive_that_is_there_now() -> None:
    """Controlword and statusword by function 43 (CiA 309-2) after a power cycle are those of the new drive."""
    bench = FaultBench()
    service = ModbusService(bench.virtual.drives)
    read_60ff = bytes.fromhex("2B 0D 00 00 00 60 FF 00 00 00 00 00")
    bench.enable(ROTATE)
    bench.write(ROTATE, 0x60FF, 0x01020304)
    assert service.answer(ROTATE, read_60ff)[-4:] == bytes.fromhex("04 03 02 01")
    bench.strike("power_cycle", node=ROTATE, off=0)
    bench.write(ROTATE, 0x6060, PROFILE_VELOCITY)
    assert service.answer(ROTATE, read_60ff)[-4:] == bytes(4)
