"""Who moves time: SYNC alone, or the wall clock with cycles locked to SYNC."""

from __future__ import annotations

import struct
from collections.abc import Iterable

import can
import numpy as np
import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import CLOCKS, RealtimeClock, SyncClock
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

CYCLE = 0.001
TOLD = round(CYCLE / SERVO_PERIOD)
"""1006h in servo periods."""


def test_known_clocks() -> None:
    assert set(CLOCKS) == {"realtime", "sync"}


# -- lockstep --------------------------------------------------------------------------------------------------------


def scara(seed: int) -> tuple[VirtualMachine, list[can.Message]]:
    machine = load_machine("scara")
    frames: list[can.Message] = []
    virtual = VirtualMachine(
        machine, load_profile("servoone"), read_effects(machine.effects_path), SyncClock(), seed, frames.append
    )
    virtual.power_on()
    return virtual, frames


def send(virtual: VirtualMachine, cob_id: int, data: bytes = b"") -> None:
    virtual.receive(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))


def download(virtual: VirtualMachine, node: int, index: int, subindex: int, data: bytes) -> None:
    command = 0x23 | (4 - len(data)) << 2
    send(virtual, 0x600 + node, struct.pack("<BHB", command, index, subindex) + data.ljust(4, b"\0"))


def session(seed: int, polls: int = 0) -> list[tuple[float, int, bytes]]:
    """Three drives enabled and moved in mode 7, position and float torque by TPDO; every frame with its time."""
    virtual, frames = scara(seed)
    for node in (1, 2, 3):
        download(virtual, node, 0x1017, 0, struct.pack("<H", 10))
        download(virtual, node, 0x1A01, 0, b"\0")
        download(virtual, node, 0x1A01, 1, struct.pack("<I", 0x60640020))
        download(virtual, node, 0x1A01, 2, struct.pack("<I", 0x21A30020))
        download(virtual, node, 0x1A01, 0, b"\2")
        download(virtual, node, 0x1801, 2, b"\1")
        download(virtual, node, 0x1801, 1, struct.pack("<I", 0x280 + node))
        download(virtual, node, 0x6060, 0, b"\7")
    send(virtual, 0, b"\1\0")
    for controlword in (6, 7, 15):
        for node in (1, 2, 3):
            send(virtual, 0x200 + node, struct.pack("<H", controlword))
        send(virtual, 0x80)
    for step in range(150):
        for node in (1, 2, 3):
            setpoint = round(200_000 * (1.0 - np.cos(0.02 * step)))
            download(virtual, node, 0x60C1, 1, struct.pack("<i", setpoint))
            send(virtual, 0x200 + node, struct.pack("<H", 0x1F))
        send(virtual, 0x80)
        for _ in range(polls):
            virtual.poll()
    return [(frame.timestamp, frame.arbitration_id, bytes(frame.data)) for frame in frames]


def test_two_runs_are_bit_identical() -> None:
    first = session(seed=7)
    assert len(first) > 3 * 150
    assert sum(identifier == 0x702 for _, identifier, _ in first) >= 15  # the heartbeat runs on the same clock
    assert first == session(seed=7)


def test_another_seed_is_another_run_of_the_same_motion() -> None:
    def part(frames: list[tuple[float, int, bytes]], data: slice) -> list[bytes]:
        return [frame[data] for _, identifier, frame in frames if identifier == 0x282]

    one, other = session(seed=7), session(seed=8)
    assert part(one, slice(0, 4)) == part(other, slice(0, 4))  # noise is in the current sensor, not in the loops
    assert part(one, slice(4, 8)) != part(other, slice(4, 8))


def test_polling_moves_nothing() -> None:
    assert session(seed=7, polls=3) == session(seed=7)


@pytest.mark.parametrize(
    ("period", "cycle"), [(0, 0.001), (1000, 0.001), (2000, 0.002), (250, 0.00025), (200_000, 0.2), (10, SERVO_PERIOD)]
)
def test_a_sync_is_one_cycle_of_1006h(period: int, cycle: float) -> None:
    virtual, _ = scara(0)
    download(virtual, 1, 0x1006, 0, struct.pack("<I", period))
    send(virtual, 0x80)
    assert virtual.now() == pytest.approx(cycle, abs=1e-12)
    assert virtual.plant.time == pytest.approx(cycle, abs=1e-12)


def test_a_cycle_is_whole_servo_periods_on_the_bus_and_in_the_plant() -> None:
    """1006h = 300 us is no multiple of 125 us: the drives' clock and the plant must not drift apart."""
    virtual, _ = scara(0)
    download(virtual, 1, 0x1006, 0, struct.pack("<I", 300))
    for _ in range(100):
        send(virtual, 0x80)
    assert virtual.now() == pytest.approx(virtual.plant.time, abs=1e-9)


def test_frames_that_are_not_canopens() -> None:
    virtual, frames = scara(0)
    seen = len(frames)
    for frame in (
        can.Message(arbitration_id=0x80, is_extended_id=True),
        can.Message(arbitration_id=0x80, is_error_frame=True, is_extended_id=False),
        can.Message(arbitration_id=0x80, is_fd=True, is_extended_id=False),
        can.Message(arbitration_id=0x80, is_remote_frame=True, is_extended_id=False),
    ):
        virtual.receive(frame)
    assert virtual.now() == 0.0
    assert len(frames) == seen


# -- the wall clock --------------------------------------------------------------------------------------------------


class Wall:
    """A wall clock that a test moves, and the cycles that the clock under test gave."""

    def __init__(self) -> None:
        self.time = 100.0
        self.clock = RealtimeClock(lambda: self.time)

    def sync_at(self, times: Iterable[float]) -> list[int]:
        """Cycles at each SYNC; between them the clock is polled and must give none."""
        given = []
        for time in times:
            self.time = 100.0 + time
            assert not self.clock.due(TOLD)
            early = list(self.clock.before_sync())
            given.append(len([*early, *self.clock.at_sync(TOLD)]))
            assert not self.clock.due(TOLD)
        return given

    def free(self, start: float, end: float, step: float = 0.0005) -> int:
        """Cycles that come by themselves while polled from start to end."""
        total = 0
        for time in np.arange(start, end, step):
            self.time = 100.0 + float(time)
            total += len(list(self.clock.due(TOLD)))
        return total


def test_each_jittered_sync_is_one_cycle() -> None:
    jitter = np.random.default_rng(1).uniform(-0.004, 0.004, 5000)
    times = np.maximum.accumulate(0.01 + CYCLE * np.arange(5000) + jitter)
    wall = Wall()
    assert wall.sync_at([0.0]) == [1]
    assert wall.sync_at(times) == [1] * 5000


def test_syncs_after_a_stall_are_one_cycle_each() -> None:
    wall = Wall()
    times = [*(CYCLE * np.arange(100)), *([0.139] * 40), *(0.140 + CYCLE * np.arange(100))]
    assert wall.sync_at(times) == [1] * 240


def test_a_burst_does_not_outrun_the_wall_clock() -> None:
    wall = Wall()
    given = wall.sync_at([0.0] * 1000)
    assert sum(given) <= RealtimeClock.AHEAD / CYCLE + 1
    assert given == sorted(given, reverse=True)
    assert sum(wall.sync_at([0.1 * CYCLE * step for step in range(10_000)])) <= 1000 + RealtimeClock.AHEAD / CYCLE


def test_silence_runs_free_at_the_walls_pace() -> None:
    wall = Wall()
    assert wall.sync_at(CYCLE * np.arange(101)) == [1] * 101
    assert wall.free(0.1, 0.1 + 0.98 * RealtimeClock.HOLD_OFF) == 0
    assert wall.free(0.1 + 0.98 * RealtimeClock.HOLD_OFF, 1.1) == pytest.approx(999, abs=1)


def test_no_sync_ever() -> None:
    assert Wall().free(0.0, 2.0) == pytest.approx(2000, abs=1)


@pytest.mark.parametrize("step", [0.0004, 0.0007, 0.0033])
def test_free_running_loses_nothing_between_polls(step: float) -> None:
    assert Wall().free(0.0, 5.0, step) == pytest.approx(5000, abs=4)


def test_slow_syncs_do_not_gain_time() -> None:
    """A SYNC each 100 ms where cycles are 1 ms: free-running and SYNC cycles together keep the wall's pace."""
    wall = Wall()
    cycles = 0
    for number in range(50):
        cycles += wall.free(0.1 * number, 0.1 * (number + 1))
        wall.time = 100.0 + 0.1 * (number + 1)
        cycles += len([*wall.clock.before_sync(), *wall.clock.at_sync(TOLD)])
    assert cycles == pytest.approx(5000, abs=RealtimeClock.AHEAD / CYCLE + 1)


def test_no_jump_after_a_long_slow_phase() -> None:
    """Ten seconds of SYNCs at half the pace: what was missed is not made up when they stop, nor by a burst."""
    wall = Wall()
    assert wall.sync_at(2.0 * CYCLE * np.arange(5000)) == [1] * 5000
    at_most = RealtimeClock.MAKE_UP / CYCLE + 2
    assert wall.free(10.0, 10.0 + RealtimeClock.HOLD_OFF + 0.0005) <= at_most
    wall = Wall()
    wall.sync_at(2.0 * CYCLE * np.arange(5000))
    burst = wall.sync_at([9.998] * 500)
    assert sum(burst) <= at_most + RealtimeClock.AHEAD / CYCLE


def test_no_jump_after_the_host_slept() -> None:
    wall = Wall()
    wall.free(0.0, 1.0)
    wall.time += 3600.0
    assert len(list(wall.clock.due(TOLD))) <= RealtimeClock.MAKE_UP / CYCLE
    assert wall.clock.wait() == RealtimeClock.POLL


def test_realtime_machine_runs_by_polling() -> None:
    now = [5.0]
    machine = load_machine("stage")
    frames: list[can.Message] = []
    virtual = VirtualMachine(
        machine, load_profile("servoone"), read_effects(machine.effects_path), RealtimeClock(lambda: now[0]), 0, frames.append
    )
    virtual.power_on()
    download(virtual, 1, 0x1017, 0, struct.pack("<H", 100))
    for _ in range(100):
        now[0] += 0.01
        virtual.poll()
    assert virtual.now() == pytest.approx(1.0, abs=0.0021)
    assert virtual.plant.time == pytest.approx(virtual.now(), abs=1e-9)
    assert sum(frame.arbitration_id == 0x701 for frame in frames) == pytest.approx(11, abs=1)  # boot-up and heartbeats
