"""`--clock realtime` under a SYNC of any period: timers are the wall clock's, set-points are SYNC's, 1006h may say nothing.

dcfgen (lely), `canopen` and canopend write no 1006h of a slave; CiA 301, 7.5.2.6, has it for the SYNC producer and as what a
consumer may monitor, so a drive has to do without it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from math import pi

import can
import numpy as np
import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import RealtimeClock
from drivetwin.emulator.drive.servo import SERVO_PERIOD
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

POLL = 0.0005
TURN = 1 << 20
"""Position units: increments a motor turn."""


class Wall:
    """A drive on the stage, whose wall clock the test moves; a SYNC every `period` seconds with a little jitter."""

    def __init__(self, period: float | None, jitter: float = 0.0, profile: str = "cia402-full") -> None:
        self.time = 1000.0
        self.frames: list[tuple[float, can.Message]] = []
        self.beat(period)
        self._jitter = np.random.default_rng(5).uniform(-jitter, jitter, 100_000)
        self.machine = VirtualMachine(
            load_machine("stage"), load_profile(profile), (), RealtimeClock(lambda: self.time), 0, self._note
        )
        self.machine.power_on()
        self.drive = self.machine.drives[0]

    def beat(self, period: float | None) -> None:
        """Send SYNCs of another period from now on, or none."""
        self._period, self._began, self._next, self._count = period, self.time, self.time, 0

    def write(self, index: int, value: float, subindex: int = 0) -> None:
        self.drive.dictionary.find(index, subindex).write(value)

    def read(self, index: int) -> int:
        return int(self.drive.dictionary[index].read())

    def run(self, seconds: float, at_sync: Callable[[], None] = lambda: None) -> None:
        """Poll as the emulator does; `at_sync` is called before each SYNC."""
        until = self.time + seconds
        while self.time < until:
            self.time += POLL
            if self._period is not None and self.time >= self._next:
                self._count += 1
                self._next = self._began + self._count * self._period + float(self._jitter[self._count])
                at_sync()
                self.machine.receive(can.Message(arbitration_id=0x80, is_extended_id=False))
            self.machine.poll()

    def until(self, done: Callable[[], bool], most: float = 60.0) -> float:
        """Seconds of the wall clock until `done`."""
        begin = self.time
        while not done() and self.time < begin + most:
            self.run(POLL)
        return self.time - begin

    def send(self, cob_id: int, data: bytes) -> None:
        self.machine.receive(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))

    def map_rpdo(self, entry: int) -> None:
        """RPDO 1 carries one object, and acts at SYNC; the node is operational."""
        self.write(0x1400, 0x80000201, 1)
        for index, value, subindex in ((0x1600, 0, 0), (0x1600, entry, 1), (0x1600, 1, 0), (0x1400, 1, 2), (0x1400, 0x201, 1)):
            self.write(index, value, subindex)
        self.send(0, b"\1\1")

    def on_cycle(self, look: Callable[[], None]) -> None:
        """Call `look` once the drive has planned a cycle."""
        plan = self.drive.plan

        def planned() -> None:
            plan()
            look()

        self.drive.plan = planned  # type: ignore[method-assign]

    def enable(self, mode: int) -> None:
        self.write(0x6060, mode)
        for controlword in (6, 7, 15):
            self.write(0x6040, controlword)
            self.run(0.1)
        assert self.read(0x6041) & 0x6F == 0x27

    def beats(self) -> list[float]:
        """When heartbeats came."""
        return [time for time, frame in self.frames if frame.arbitration_id == 0x701]

    def _note(self, frame: can.Message) -> None:
        self.frames.append((self.time, frame))


@pytest.mark.parametrize("told", [0, 10_000, 200_000])
@pytest.mark.parametrize("period", [None, 0.001, 0.01, 0.02, 0.1, 1.0])
def test_a_heartbeat_is_the_wall_clocks(period: float | None, told: int) -> None:
    """CiA 301, 7.5.2.20: 1017h counts milliseconds, of time and not of SYNCs."""
    wall = Wall(period, jitter=0.0004)
    wall.write(0x1006, told)
    wall.write(0x1017, 100)
    wall.run(5.0)
    assert np.diff(wall.beats()[1:]) == pytest.approx(0.1, abs=0.003)
    assert len(wall.beats()) == pytest.approx(50, abs=1)


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("period", [None, 0.002, 0.005, 0.01, 0.02, 0.06, 0.1, 0.5])
def test_a_profile_takes_its_own_time(period: float | None, told: bool) -> None:
    """One turn at one turn a second by ten turns a second squared is 1.1 s of the wall clock, whatever the period of SYNC."""
    wall = Wall(period, jitter=0.0004)
    if told:
        wall.write(0x1006, round((period or 0.1) * 1e6))
    wall.run(0.5)
    for index, value in ((0x6081, TURN), (0x6083, 10 * TURN), (0x6084, 10 * TURN), (0x6067, TURN // 100)):
        wall.write(index, value)
    wall.enable(1)
    start = wall.read(0x6064)
    wall.write(0x607A, start + TURN)
    wall.write(0x6040, 0x1F)
    wall.run(0.02)
    assert wall.until(lambda: bool(wall.read(0x6041) & 1 << 10)) == pytest.approx(1.1, abs=0.03)
    assert wall.read(0x6064) - start == pytest.approx(TURN, abs=TURN // 50)


@pytest.mark.parametrize("mode", [7, 8])
@pytest.mark.parametrize(("period", "told"), [(0.001, 0), (0.005, 0), (0.01, 0), (0.02, 0), (0.02, 20_000), (0.1, 100_000)])
def test_set_points_at_sync_are_evenly_spaced(period: float, told: int, mode: int) -> None:
    """Two turns a second, a synchronous RPDO a SYNC that comes with jitter: from cycle to cycle the demanded speed is that."""
    wall = Wall(period, jitter=0.0015 if period > 0.002 else 0.0)
    wall.write(0x1006, told)
    wall.run(max(1.0, 3 * period))
    wall.enable(mode)
    wall.write(0x6040, 0x1F)
    wall.map_rpdo(0x60C10120 if mode == 7 else 0x607A0020)
    speeds: list[float] = []
    position = wall.read(0x6064)

    def stream() -> None:
        nonlocal position
        position += round(2 * TURN * period)
        wall.send(0x201, struct.pack("<i", position))

    wall.run(8 * period, stream)
    wall.on_cycle(lambda: speeds.extend(wall.drive.axis.servo.demand[:, 1] / (2.0 * pi)))
    wall.run(40 * period, stream)
    assert len(speeds) == pytest.approx(40 * period / SERVO_PERIOD, rel=0.1)
    assert np.array(speeds) == pytest.approx(2.0, rel=1e-3)


def test_a_speed_streamed_at_sync_is_a_line() -> None:
    """Mode 9, CiA 402-2: from set-point to set-point within the period of SYNC, no staircase."""
    wall = Wall(0.02)
    wall.run(1.0)
    wall.enable(9)
    wall.map_rpdo(0x60FF0020)
    count = 0
    slopes: list[float] = []

    def stream() -> None:
        nonlocal count
        count += 1
        wall.send(0x201, struct.pack("<i", round(2.0 * TURN * 0.02 * count)))

    wall.run(0.1, stream)
    wall.on_cycle(lambda: slopes.extend(np.diff(wall.drive.axis.servo.demand[:, 1]) / SERVO_PERIOD / (2.0 * pi)))
    wall.run(0.2, stream)
    assert np.array(slopes) == pytest.approx(2.0, rel=0.01)


def test_a_long_1006h_without_sync_does_not_stop_the_drive() -> None:
    """CiA 301, 7.5.2.6: 1006h of 60 ms and more; without a SYNC the drive runs by its own time."""
    for told in (60_000, 100_000, 5_000_000, 0xFFFFFFFF):
        wall = Wall(None)
        wall.write(0x1006, told)
        wall.write(0x6083, 10 * TURN)
        wall.enable(3)
        wall.write(0x60FF, TURN)
        start = wall.read(0x6064)
        wall.run(1.1)
        assert wall.read(0x6064) - start == pytest.approx(1.05 * TURN, rel=0.02)


def test_a_1006h_that_syncs_belie_is_not_believed() -> None:
    """1006h = 1 ms and a SYNC every 20 ms: motion goes by the wall clock."""
    wall = Wall(0.02)
    wall.write(0x1006, 1000)
    wall.write(0x6083, 10 * TURN)
    wall.run(1.0)
    wall.enable(3)
    wall.write(0x60FF, TURN)
    start = wall.read(0x6064)
    wall.run(1.1)
    assert wall.read(0x6064) - start == pytest.approx(1.05 * TURN, rel=0.05)


def test_a_master_that_pauses_and_comes_back_with_another_period() -> None:
    """Motion keeps the wall clock's pace before, meanwhile and after."""
    wall = Wall(0.001)
    wall.write(0x6083, 10 * TURN)
    wall.run(0.5)
    wall.enable(3)
    wall.write(0x60FF, TURN)
    wall.run(0.5)
    for period in (None, 0.02, None, 0.001, 0.1, 0.005):
        wall.beat(period)
        wall.run(0.3)  # until the new period is known
        start = wall.read(0x6064)
        wall.run(2.0)
        assert wall.read(0x6064) - start == pytest.approx(2.0 * TURN, rel=0.05), period


def test_guarding_and_event_timers_are_the_wall_clocks() -> None:
    """CiA 301, 7.5.2.36: an event timer of 50 ms under a SYNC of 200 ms; 100Ch, 100Dh: a life time of 300 ms."""
    wall = Wall(0.2)
    wall.write(0x1006, 200_000)
    wall.send(0, b"\1\1")
    wall.write(0x1800, 0x80000181, 1)
    wall.write(0x1800, 50, 5)
    wall.write(0x1800, 0x181, 1)
    wall.run(2.0)
    sent = [time for time, frame in wall.frames if frame.arbitration_id == 0x181]
    assert len(sent) == pytest.approx(40, abs=2)
    wall.write(0x100C, 100)
    wall.write(0x100D, 3)
    asked = wall.time
    wall.machine.receive(can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False))
    wall.run(0.29)
    codes = [struct.unpack_from("<H", frame.data)[0] for _, frame in wall.frames if frame.arbitration_id == 0x81]
    assert 0x8130 not in codes
    wall.run(0.02)
    told = [time for time, frame in wall.frames if frame.arbitration_id == 0x81 and frame.data[:2] == b"\x30\x81"]
    assert told[0] - asked == pytest.approx(0.3, abs=0.002)
