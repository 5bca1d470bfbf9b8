"""An acceptance as a whole: the bench, and the verdict of every case."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.verdict import CaseResult, Outcome


@dataclass(frozen=True)
class Acceptance:
    """The cases in the order in which a machine comes alive; `digest` is over all that two lockstep runs must share."""

    bench: Bench
    cases: tuple[CaseResult, ...]
    digest: str

    def of(self, outcome: Outcome) -> tuple[CaseResult, ...]:
        """The cases of one outcome."""
        return tuple(case for case in self.cases if case.outcome is outcome)

    @property
    def accepted(self) -> bool:
        """Whether no case was rejected, and at least one was judged."""
        return bool(self.of(Outcome.ACCEPTED)) and not self.of(Outcome.REJECTED)
