"""A drive that produces SYNC on `--clock realtime`: for the bus, for itself, for the other drives of the machine."""

from __future__ import annotations

import can

from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import RealtimeClock, SyncClock
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

POLL = 0.0005
PRODUCE = 0x4000_0080


class Scara:
    """Three drives whose wall clock the test moves."""

    def __init__(self) -> None:
        self.time = 100.0
        self.frames: list[can.Message] = []
        clock = RealtimeClock(lambda: self.time)
        self.machine = VirtualMachine(
            load_machine("scara"), load_profile("cia402-full"), (), clock, 0, self.frames.append
        )
        self.machine.power_on()
        self.nodes = [drive.device.node_id for drive in self.machine.drives]

    def write(self, drive: int, index: int, value: int, subindex: int = 0) -> None:
        self.machine.drives[drive].dictionary.find(index, subindex).write(value)

    def run(self, seconds: float) -> list[int]:
        """CAN-IDs of what was sent."""
        self.frames.clear()
        until = self.time + seconds
        while self.time < until:
            self.time += POLL
            self.machine.poll()
        return [frame.arbitration_id for frame in self.frames]

    def answer_to_sync(self) -> None:
        """TPDO 2 of every drive goes with each SYNC."""
        for drive, node in enumerate(self.nodes):
            for pdo in range(4):
                self.write(drive, 0x1800 + pdo, 0x8000_0000 | 0x180 + 0x100 * pdo | node, 1)
            self.write(drive, 0x1801, 1, 2)
            self.write(drive, 0x1801, 0x280 + node, 1)
        self.machine.receive(can.Message(arbitration_id=0, data=b"\1\0", is_extended_id=False))


def test_every_drive_of_the_machine_hears_it() -> None:
    scara = Scara()
    scara.answer_to_sync()
    scara.write(1, 0x1006, 10_000)
    scara.write(1, 0x1005, PRODUCE)
    sent = scara.run(1.0)
    assert 99 <= sent.count(0x80) <= 101
    assert {sent.count(0x280 + node) for node in scara.nodes} == {sent.count(0x80)}


def test_time_of_one_drive_is_that_of_all() -> None:
    scara = Scara()
    scara.write(0, 0x1012, 0x4000_0100)
    assert scara.run(2.5).count(0x100) == 2
    assert scara.machine.drives[2].device.time_stamp.time_of_day() is not None


def test_a_drive_without_power_produces_nothing() -> None:
    scara = Scara()
    scara.write(1, 0x1006, 10_000)
    scara.write(1, 0x1005, PRODUCE)
    scara.machine.switch_off(1)
    assert 0x80 not in scara.run(0.2)


def test_no_clock_but_the_walls_lets_a_drive_produce() -> None:
    assert RealtimeClock.runs_alone
    assert not SyncClock.runs_alone
