"""How the controller ends: done, stopped by a fault, or refused; any other end is an error of the controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.evidence import Ending, Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding
from drivetwin.hil_tests.task import Task

SOUND = (Ending.DONE, Ending.STOPPED, Ending.REFUSED, Ending.KILLED)
"""Ways to end that may be expected of a controller."""


@dataclass(frozen=True)
class Outcome(Expectation):
    """`done`, `stopped`, `refused`, `killed` (by the stand), or several with `or` between; a list, one for each start."""

    name: ClassVar[str] = "outcome"
    needs_truth: ClassVar[bool] = False
    shorthand: ClassVar[str | None] = "expected"

    expected: tuple[str, ...]

    def check(self, bench: Bench, task: Task, starts: int) -> None:
        if len(self.expected) not in (1, starts):
            raise UserError(f"there are {len(self.expected)}, and starts: {starts}; say one, or one for each start")
        for word in (word for expected in self.expected for word in _words(expected)):
            if word not in SOUND:
                raise UserError(f"{word!r} is not an outcome; there are {', '.join(SOUND)}, and several with `or` between")

    def judge(self, evidence: Evidence) -> Finding:
        finding, all_ran = MET, evidence.bus_lost is None
        for number, (expected, run) in enumerate(zip(self._of_each(len(evidence.runs)), evidence.runs, strict=all_ran)):
            if run.ending.value in _words(expected):
                continue
            which = f" at start {number + 1}" if len(evidence.runs) > 1 else ""
            status = "" if run.status is None else f" (exit status {run.status})"
            words = " ".join(run.last_words.split())
            finding += self.fails(
                f"the controller ended as {run.ending.value!r}{status}{which}, expected {expected!r}"
                + (f"; it said: {words}" if words else ""),
                time=run.ended,
            )
        return finding

    def _of_each(self, starts: int) -> tuple[str, ...]:
        return self.expected * starts if len(self.expected) == 1 else self.expected


def _words(expected: str) -> list[str]:
    """The ways to end that one start may take."""
    return [word.strip() for word in expected.split(" or ")]
