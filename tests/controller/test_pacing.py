"""When the next cycle starts, on a clock of the test's own."""

from __future__ import annotations

import sys
import threading
import time

import pytest
from virtual_bench import VirtualBench

from drivetwin.controller.pacing import PACINGS, Lockstep, Paced, Realtime
from drivetwin.emulator.clock import RealtimeClock
from drivetwin.foundation.errors import UserError

CYCLE = 0.001


class Wall:
    """A wall clock that only sleeping and `pass_by` move; a sleep may take longer than asked."""

    def __init__(self) -> None:
        self.time = 100.0
        self.overslept = 0.0
        self.slept: list[float] = []

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.time += seconds + self.overslept


def test_lockstep_never_waits_and_its_time_is_the_number_of_cycles() -> None:
    pacing = Lockstep()
    for _ in range(250):
        pacing.wait(CYCLE)
    assert pacing.time() == pytest.approx(0.25)
    assert pacing.late_cycles == 0


def test_realtime_keeps_the_grid_whatever_the_work_takes() -> None:
    wall = Wall()
    pacing = Realtime(wall.now, wall.sleep)
    starts = []
    for cycle in range(1000):
        pacing.wait(CYCLE)
        starts.append(wall.time)
        wall.time += 0.0009 if cycle % 2 else 0.0001
    assert starts == pytest.approx([100.0 + cycle * CYCLE for cycle in range(1000)])
    assert pacing.late_cycles == 0


def test_small_lateness_is_caught_up_and_does_not_add_up() -> None:
    wall = Wall()
    wall.overslept = 0.0001
    pacing = Realtime(wall.now, wall.sleep)
    for _ in range(1000):
        pacing.wait(CYCLE)
    assert wall.time == pytest.approx(100.0 + 999 * CYCLE + 0.0001)
    assert pacing.late_cycles == 0


def test_a_late_cycle_is_counted_and_the_others_are_not_hurried() -> None:
    wall = Wall()
    pacing = Realtime(wall.now, wall.sleep)
    pacing.wait(CYCLE)
    wall.time += 0.0305
    pacing.wait(CYCLE)
    assert (pacing.late_cycles, pacing.worst_lateness) == pytest.approx((1, 0.0295))
    for _ in range(10):
        pacing.wait(CYCLE)
    assert wall.slept == pytest.approx([CYCLE] * 10)
    assert pacing.late_cycles == 1


def test_the_time_from_sync_to_sync_is_told_as_it_was() -> None:
    wall = Wall()
    pacing = Realtime(wall.now, wall.sleep)

    def after(seconds: float) -> float:
        wall.time += seconds
        return pacing.lap(CYCLE)

    assert [after(0.5), after(CYCLE), after(0.03), after(CYCLE)] == pytest.approx([CYCLE, CYCLE, 0.03, CYCLE])
    assert Lockstep().lap(CYCLE) == CYCLE


def test_cycles_go_on_while_something_is_computed() -> None:
    ten_cycles_are_over = threading.Event()
    cycles = 0

    def run_cycle() -> None:
        nonlocal cycles
        cycles += 1
        if cycles == 10:
            ten_cycles_are_over.set()

    assert Realtime().meanwhile(lambda: ten_cycles_are_over.wait(10.0), run_cycle) is True
    assert cycles >= 10
    assert Lockstep().meanwhile(lambda: "found", run_cycle=pytest.fail) == "found", "time stands still"


def test_trouble_on_the_bus_does_not_wait_for_a_computation() -> None:
    may_end, ended = threading.Event(), threading.Event()
    usual = sys.getswitchinterval()

    def compute() -> None:
        may_end.wait(10.0)
        ended.set()

    def trouble() -> None:
        raise UserError("a drive is silent")

    with pytest.raises(UserError, match="a drive is silent"):
        Realtime().meanwhile(compute, trouble)
    assert not ended.is_set()
    assert sys.getswitchinterval() < usual, "axes are being stopped beside it"
    may_end.set()
    for _ in range(1000):
        if sys.getswitchinterval() == usual:
            break
        time.sleep(0.01)
    assert sys.getswitchinterval() == usual


def test_what_a_computation_refuses_is_raised() -> None:
    def refused() -> None:
        raise UserError("the model lacks a joint")

    with pytest.raises(UserError, match="lacks a joint"):
        Realtime().meanwhile(refused, lambda: None)


def test_the_names_of_the_command_line() -> None:
    assert {"sync": Lockstep, "realtime": Realtime} == PACINGS


def test_drives_that_keep_time_by_themselves_are_not_driven_in_lockstep() -> None:
    bench = VirtualBench(clock=RealtimeClock()).up()
    bench.cycle.stop()
    with pytest.raises(UserError, match=r"keeps time by itself.*give --clock realtime"):
        Lockstep().check(bench.link, bench.drives[0])
    Realtime().check(bench.link, bench.drives[0])
    assert bench.drives[0].read(0x1017) == 100, "as before"


def test_drives_that_sync_moves_are_driven_by_either() -> None:
    bench = VirtualBench().up()
    bench.cycle.stop()
    Lockstep().check(bench.link, bench.drives[0])
    Realtime().check(bench.link, bench.drives[0])
    assert bench.drives[0].read(0x1017) == 100, "as before"


def test_paced_cycles_start_when_they_are_due_and_time_is_the_number_of_them() -> None:
    wall = Wall()
    pacing = Paced(wall.now, wall.sleep)
    starts = []
    for _ in range(5):
        pacing.wait(CYCLE)
        starts.append(wall.time)
    assert starts == pytest.approx([100.0 + CYCLE * number for number in range(5)])
    assert pacing.time() == pytest.approx(5 * CYCLE)


def test_a_paced_cycle_that_is_late_is_not_caught_up() -> None:
    wall = Wall()
    pacing = Paced(wall.now, wall.sleep)
    pacing.wait(CYCLE)
    wall.time += 10 * CYCLE
    pacing.wait(CYCLE)
    late = wall.time
    pacing.wait(CYCLE)
    assert (late, wall.time) == pytest.approx((100.0 + 10 * CYCLE, 100.0 + 11 * CYCLE))
    assert (pacing.time(), pacing.lap(CYCLE)) == pytest.approx((3 * CYCLE, CYCLE))
