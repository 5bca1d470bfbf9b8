"""Stand-ins for the recorder and the diagnosis: instant, and leaving a trace of every call."""

from __future__ import annotations

import os
import sys
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from distributed import Client

from drivetwin.blind.case import Case, Cause
from drivetwin.blind.cluster import cluster
from drivetwin.blind.place import Place
from drivetwin.blind.run import Order, run
from drivetwin.blind.score import Score
from drivetwin.blind.task import Procedure

DIAGNOSER = (sys.executable, str(Path(__file__).with_name("stub_diagnoser.py")))

SECRET_AXIS, SECRET_SIZE, SEED = "axis_that_only_the_key_names", 0.918273645, 564738291


def secret_cases(count: int) -> tuple[Case, ...]:
    """Cases whose truth is easy to search for."""
    cause = Cause("viscous", SECRET_AXIS, {"viscous": SECRET_SIZE})
    return tuple(Case(number, SEED + number, "arm", "single", (cause,), "lugre") for number in range(count))


def record(case: Case, folder: Path, *, calls: Path, deadly: int | None) -> None:
    """A case's folder with only its number in it; each call leaves a file in `calls`."""
    calls.mkdir(parents=True, exist_ok=True)
    first = not any(calls.glob(f"{case.number}_*"))
    (calls / f"{case.number}_{uuid.uuid4().hex}").touch()
    if first and case.number == deadly:
        os._exit(1)
    for recording in ("training/a", "validation/b", "fresh/c"):
        (folder / recording).mkdir(parents=True)
    for model in ("model.xml", "model_off.xml"):
        (folder / model).write_text(str(case.number), encoding="utf-8")


@dataclass
class CountingWatch:
    """Calls `after_each` with the number of cases that were examined."""

    after_each: Callable[[int], None] = lambda _done: None
    commitment: str = ""
    answered: int = 0
    examined_now: int = 0
    failed_by_other_code: int | None = None
    claims_tried: int = 0

    def sealed(self, commitment: str, answered: int) -> None:
        self.commitment, self.answered = commitment, answered

    def of_other_code(self, failed: int) -> None:
        self.failed_by_other_code = failed

    def examined(self) -> None:
        self.examined_now += 1
        self.after_each(self.examined_now)

    def claims(self, count: int) -> None:
        self.claims_tried = count

    def tried(self) -> None:
        pass


@dataclass(frozen=True)
class Stubs:
    """Whole runs of stand-ins below `folder`: out/ and a file in calls/ for every recording that was made."""

    folder: Path
    workers: AbstractContextManager[Client]
    code: str = "code"

    @property
    def out(self) -> Path:
        return self.folder / "out"

    @property
    def calls(self) -> dict[int, int]:
        """How often each case was recorded."""
        numbers = [int(path.name.split("_")[0]) for path in (self.folder / "calls").iterdir()]
        return {number: numbers.count(number) for number in sorted(set(numbers))}

    def run(self, count: int, watch: CountingWatch | None = None, deadly: int | None = None) -> Score:
        """Record and diagnose `count` cases; the first recording of the case `deadly` takes its worker along."""
        recorder = partial(record, calls=self.folder / "calls", deadly=deadly)
        procedure = Procedure(self.code, record=recorder, diagnoser=DIAGNOSER)
        order = Order(secret_cases(count), SEED, ("exact", "off"))
        return run(order, Place(self.out), procedure, self.workers, watch or CountingWatch())


if __name__ == "__main__":
    Stubs(Path(sys.argv[1]), cluster(None, 1)).run(int(sys.argv[2]))
