"""A campaign of blind cases on two Dask workers beside the same on one: what the second core brings.

Each case is drawn by the wide generator, recorded and diagnosed as by `drivetwin blind`. Time is processor time of each
process, since other work may share the machine. With both cores free the campaign takes as long as its busier worker, so the
gain is that time with one worker over that with two. Wall-clock time is printed beside it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import psutil
from distributed import Client

from drivetwin.blind.case import Case
from drivetwin.blind.cluster import cluster
from drivetwin.blind.place import Place, code_hash
from drivetwin.blind.run import Order, run
from drivetwin.blind.task import Layout, Procedure
from drivetwin.blind.wide.choice import choice
from drivetwin.blind.wide.draw import draw_wide
from drivetwin.blind.wide.record import record_wide
from drivetwin.foundation.files import provenance, write_json
from drivetwin.foundation.scratch import scratch

FAMILIES = ("rotary", "pendulum", "linear", "lift")
"""Machines of one axis: a case takes seconds."""


@dataclass(frozen=True)
class Spent:
    """Processor time of the process that asks and of each worker with its diagnosing process, and wall-clock time [s]."""

    asking: float
    workers: tuple[float, ...]
    wall: float

    @property
    def busiest(self) -> float:
        """What the campaign takes where each process has a core, and the one that asks shares that of a worker."""
        return self.asking + max(self.workers)


class Unwatched:
    """Nobody is told how far a run is."""

    def sealed(self, commitment: str, answered: int) -> None:
        """Nothing."""

    def of_other_code(self, failed: int) -> None:
        """Nothing."""

    def examined(self) -> None:
        """Nothing."""

    def claims(self, count: int) -> None:
        """Nothing."""

    def tried(self) -> None:
        """Nothing."""


def campaign(cases: Sequence[Case], seed: int, workers: int) -> Spent:
    """Record, diagnose and score the cases on so many workers."""
    procedure = Procedure(code_hash(()), record=record_wide, layout=Layout("train_*", "validate_*", None))
    spent: list[float] = []
    began, asking = time.monotonic(), time.process_time()
    with scratch() as folder:
        run(Order(cases, seed, ("exact",)), Place(folder / "out"), procedure, _timed(workers, spent), Unwatched())
    return Spent(time.process_time() - asking, tuple(spent), time.monotonic() - began)


@contextmanager
def _timed(workers: int, spent: list[float]) -> Iterator[Client]:
    """A cluster; `spent` gets the processor time of each worker when it has done its work."""
    with cluster(None, workers) as client:
        before = client.run(processor_time)
        yield client
        spent.extend(used - before[worker] for worker, used in client.run(processor_time).items())


def processor_time() -> float:
    """Of this process and all that it has started [s]."""
    this = psutil.Process()
    used = [process.cpu_times() for process in (this, *this.children(recursive=True))]
    return sum(one.user + one.system + one.children_user + one.children_system for one in used)


def main() -> None:
    """Measure, print, write campaign.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=64)
    parser.add_argument("--seed", type=int, default=18)
    parser.add_argument("--out", type=Path, default=Path("out/campaign"))
    told = parser.parse_args()
    cases = draw_wide(told.cases, told.seed, choice(FAMILIES, (), None))
    one, two = (campaign(cases, told.seed, workers) for workers in (1, 2))
    for spent in (one, two):
        workers = " and ".join(f"{seconds:.1f} s" for seconds in spent.workers)
        print(f"workers {workers}, the process that asks {spent.asking:.1f} s, wall-clock {spent.wall:.0f} s")
    gain = one.busiest / two.busiest
    print(f"{told.cases} machines: two workers are {gain:.2f} times one (wall-clock {one.wall / two.wall:.2f})")
    report = {"cases": told.cases, "one": asdict(one), "two": asdict(two), "gain": gain}
    write_json(told.out / "campaign.json", {"schema": "campaign/1", **provenance(told.seed, []), **report})


if __name__ == "__main__":
    main()
