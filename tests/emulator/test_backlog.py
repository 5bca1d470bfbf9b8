"""A plant that takes longer than real time: frames are answered all the same, and what is left out is the plant's time.

The emulator's own loop on a simulated clock: computing a cycle costs a multiple of the time that it is of, a frame 0.1 ms.
"""

from __future__ import annotations

import struct
import threading
from collections.abc import Callable

import can
import pytest

from drivetwin.cli.emulate import serve
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import RealtimeClock
from drivetwin.emulator.drive.servo import SERVO_PERIOD, ServoBank
from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.virtual_machine import VirtualMachine

HANDLING = 0.0001
"""What a frame costs beside the plant [s]."""


class Line(can.BusABC):
    """A bus on a simulated clock: a SYNC every `period`, and every 0.1 s an SDO request whose answer it times.

    `now` is the clock, which `spend` moves; after `seconds` it is `ended`.
    """

    def __init__(self, period: float, seconds: float) -> None:
        super().__init__(channel="simulated")
        self.time = 0.0
        self.waits: list[float] = []
        self._period, self._seconds = period, seconds
        self._sent = self._asked = 0
        self._open: list[float] = []
        self.ended = threading.Event()

    def now(self) -> float:
        return self.time

    def spend(self, seconds: float) -> None:
        self.time += seconds

    def recv(self, timeout: float | None = None) -> can.Message | None:
        due = min(self._sent * self._period, self._asked * 0.1)
        if self.time < due:
            self.time = min(due, self.time + (timeout or 0.0) + 1e-6)
            if self.time < due:
                return None
        if self.time > self._seconds:
            self.ended.set()
        self.spend(HANDLING)
        if self._asked * 0.1 <= self._sent * self._period:
            self._open.append(self._asked * 0.1)
            self._asked += 1
            return can.Message(arbitration_id=0x601, data=struct.pack("<BHB4x", 0x40, 0x6041, 0), is_extended_id=False)
        self._sent += 1
        return can.Message(arbitration_id=0x80, is_extended_id=False)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if msg.arbitration_id == 0x581:
            self.waits.append(self.time - self._open.pop(0))


def emulated(line: Line, told: int, cost: float) -> VirtualMachine:
    """The stage's drive after the line's time, with 1006h [us]; each second of its plant costs `cost` seconds."""
    machine = VirtualMachine(load_machine("stage"), load_profile("cia402-full"), (), RealtimeClock(line.now), 0, line.send)
    advance: Callable[[ServoBank], None] = machine.plant.advance

    def slowly(servos: ServoBank) -> None:
        advance(servos)
        line.spend(cost * servos.periods * SERVO_PERIOD)

    machine.plant.advance = slowly  # type: ignore[method-assign]
    machine.power_on()
    machine.drives[0].dictionary[0x1006].write(told)
    serve(machine, line, line.ended, line.now)
    return machine


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("period", [0.001, 0.01])
@pytest.mark.parametrize("cost", [1.05, 1.5, 3.0])
def test_answers_do_not_wait_for_the_plant(period: float, told: bool, cost: float) -> None:
    """SYNC every 1 or 10 ms, known by 1006h or measured: answers in 0.1 s, at the end of ten seconds as at their beginning."""
    line = Line(period, 10.0)
    emulated(line, round(period * 1e6) * told, cost)
    assert len(line.waits) > 95
    assert max(line.waits) < 0.1


@pytest.mark.parametrize("cost", [1.5, 3.0])
def test_the_plant_goes_on_meanwhile(cost: float) -> None:
    """It gets the time that frames leave it, but for a little."""
    line = Line(0.001, 5.0)
    assert emulated(line, 1000, cost).now() > 0.7 * (5.0 / cost) * (1.0 - HANDLING / 0.001)


def test_a_plant_that_keeps_up_leaves_nothing_out() -> None:
    """A second of the plant costs half a second: it follows the wall clock."""
    line = Line(0.001, 5.0)
    assert emulated(line, 0, 0.5).now() == pytest.approx(5.0, abs=0.01)
    assert max(line.waits) < 0.01
