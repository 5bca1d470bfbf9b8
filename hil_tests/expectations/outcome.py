"""How the controller ends: done, stopped because of a fault, or refused; anything else is no sound controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from hil_tests.evidence import Evidence
from hil_tests.expectations.base import MET, Expectation, Finding


@dataclass(frozen=True)
class Outcome(Expectation):
    """`done`, `stopped`, `refused`, `killed` (by the stand), or several with `or` between; a list, one for each start."""

    name: ClassVar[str] = "outcome"
    needs_truth: ClassVar[bool] = False
    shorthand: ClassVar[str | None] = "expected"

    expected: tuple[str, ...]

    def judge(self, evidence: Evidence) -> Finding:
        finding, all_ran = MET, evidence.bus_lost is None
        for number, (expected, run) in enumerate(zip(self._of_each(len(evidence.runs)), evidence.runs, strict=all_ran)):
            if run.ending.value in [word.strip() for word in expected.split(" or ")]:
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
