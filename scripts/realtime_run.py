"""Three moving axes at 1 kHz in real time, emulator and controller in two processes: late cycles, and SYNC to TPDO.

The controller homes the axes and moves them to and fro for as long as is asked. The time from SYNC to each drive's TPDO
contains the bus, both processes and the scheduler. So it stands beside the timer jitter of the machine itself: how late an
empty loop of 1 ms wakes up, before the run and after it, at the same priority. Ends with 1 where a sample did not come or the
axes stopped.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivetwin.bus.channel import open_bus
from drivetwin.controller.bring_up import bring_up, connect
from drivetwin.controller.cycle import Cycle
from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.link import SYNC_COB_ID, Link
from drivetwin.controller.machine import load_machine
from drivetwin.controller.motion import disable, enable_streaming, home, positions_now, stream
from drivetwin.controller.pacing import Realtime
from drivetwin.controller.trajectory import move, side_by_side
from drivetwin.controller.trouble import TroubleError
from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.collector import without_collector
from drivetwin.foundation.files import provenance, write_json
from drivetwin.foundation.priority import real_time
from drivetwin.foundation.scratch import scratch

MACHINE, PROFILE = "scara", "servoone"
PERIOD = 0.001
"""Communication cycle [s]."""

TPDO_COB_ID = 0x280
"""Of TPDO 2, less the node-ID: the sample of a cycle."""

REACH = 0.3
"""How far an axis goes to either side of the middle of its travel, as a share of the travel."""

SHARE_OF_SPEED = 0.3
"""Of an axis's full speed and acceleration, that its moves use."""

IDLE = 0.1
"""Time of each empty loop, as a share of the run."""


class TimedLink(Link):
    """A link that notes when SYNC goes out, and how long after it each sample comes [s]."""

    sent = 0.0

    def send(self, cob_id: int, data: bytes) -> None:
        """Send one data frame."""
        if cob_id == SYNC_COB_ID:
            self.sent = time.perf_counter()
        super().send(cob_id, data)

    def time_samples(self, drives: Sequence[DriveNode]) -> array[float]:
        """Where the delays go from now on, one of each drive in a cycle."""
        delays: array[float] = array("d")
        for drive in drives:
            cob_id = TPDO_COB_ID + drive.node_id
            self.fast[cob_id] = partial(self._note, delays, self.fast[cob_id])
        return delays

    def _note(self, delays: array[float], take: Callable[[bytes], None], data: bytes) -> None:
        delays.append(time.perf_counter() - self.sent)
        take(data)


@dataclass(frozen=True)
class Spread:
    """Median, 99.9 % and worst of times [s]."""

    median: float
    p999: float
    worst: float

    @classmethod
    def of(cls, times: Sequence[float]) -> Spread:
        """Of at least one time."""
        median, p999, worst = np.quantile(np.asarray(times), (0.5, 0.999, 1.0))
        return cls(float(median), float(p999), float(worst))

    def __str__(self) -> str:
        median, p999, worst = (f"{1e3 * time:.3f} ms" for time in (self.median, self.p999, self.worst))
        return f"median {median}, 99.9 % {p999}, worst {worst}"


@dataclass(frozen=True)
class Run:
    """What was counted: `late` cycles began more than half a cycle late, `missed` samples did not come, `slow` ones after the
    cycle; `trouble` is what stopped the axes, empty where nothing did."""

    cycles: int
    late: int
    worst_lateness: float
    missed: int
    slow: int
    sync_to_tpdo: Spread
    trouble: str


def timer_jitter(seconds: float) -> Spread:
    """How late an empty loop of one cycle wakes up [s]."""
    late: array[float] = array("d")
    due = time.monotonic()
    for _ in range(max(1, round(seconds / PERIOD))):
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
        late.append(time.monotonic() - due)
        due = max(due, time.monotonic() - PERIOD)
    return Spread.of(late)


def moved(link: TimedLink, seconds: float) -> Run:
    """Bring the axes up, and move them to and fro for so long."""
    known = load_machine(MACHINE)
    drives = connect(link, known, load_profile(PROFILE))
    pacing = Realtime()
    running = Cycle(link, drives, pacing)
    bring_up(link, drives, running.period)
    running.start()
    home(running, drives)
    enable_streaming(running, drives)
    delays = link.time_samples(drives)
    late, running.missed, began = pacing.late_cycles, 0, running.count
    trouble = ""
    try:
        for side in cycle((-REACH, REACH)):
            left = round(seconds / PERIOD) - (running.count - began)
            if left <= 0:
                break
            goals = known.beside_the_middle(side)
            stream(running, drives, side_by_side([_way(drive, goals[drive.name]) for drive in drives])[:left])
        disable(running, drives)
    except TroubleError as error:
        trouble = str(error)
    spread, slow = Spread.of(delays), sum(delay > PERIOD for delay in delays)
    counted = (running.count - began, pacing.late_cycles - late, pacing.worst_lateness, running.missed)
    return Run(*counted, slow, spread, trouble)


def _way(drive: DriveNode, goal: float) -> NDArray[np.float64]:
    """From where the axis is to `goal` [m or rad]."""
    (start,), axis = positions_now([drive]), drive.axis
    return move(start, goal, SHARE_OF_SPEED * axis.max_speed, SHARE_OF_SPEED * axis.max_acceleration, PERIOD)


@contextmanager
def emulator(bus: str) -> Iterator[str]:
    """A `drivetwin emulate` in a process of its own, and the first line that it says."""
    order = ["emulate", "--machine", MACHINE, "--profile", PROFILE, "--clock", "realtime", "--bus", bus]
    with subprocess.Popen([sys.executable, "-m", "drivetwin", *order], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            if not line:
                raise SystemExit("drivetwin emulate did not start")
            yield line.strip()
        finally:
            process.terminate()


def main() -> int:
    """Measure, print, write realtime_run.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--bus", help="a bus that both can join, such as vcan0; without: a socket of its own")
    parser.add_argument("--out", type=Path, default=Path("out/realtime_run"))
    told = parser.parse_args()
    with scratch() as folder, real_time() as priority, without_collector():
        bus = told.bus or f"unix:{folder / 'bus'}"
        before = timer_jitter(IDLE * told.seconds)
        with emulator(bus) as line, TimedLink(open_bus(bus)) as link:
            print(f"{line}\ncontroller {priority}", flush=True)
            run = moved(link, told.seconds)
        after = timer_jitter(IDLE * told.seconds)
    print(f"{run.cycles} cycles, {run.late} began late (worst {1e3 * run.worst_lateness:.3f} ms)")
    print(f"samples: {run.missed} did not come, {run.slow} came later than a cycle")
    print(f"SYNC to TPDO: {run.sync_to_tpdo}")
    print(f"timer alone: {before} before, {after} after")
    if run.trouble:
        print(f"stopped: {run.trouble}")
    report = {"emulator": line, "controller": priority, "timer_before": asdict(before), "timer_after": asdict(after)}
    write_json(told.out / "realtime_run.json", {"schema": "realtime_run/1", **provenance(0, []), **asdict(run), **report})
    return 1 if run.missed or run.trouble else 0


if __name__ == "__main__":
    sys.exit(main())
