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
    def wanting(self) -> tuple[str, ...]:
        """Groups that the bench needs, were chosen, and of which no case was judged."""
        judged = {case.group for case in self.cases if case.outcome is not Outcome.SKIPPED}
        chosen = dict.fromkeys(case.group for case in self.cases)
        return tuple(group for group in chosen if group in self.bench.needs and group not in judged)

    @property
    def accepted(self) -> bool:
        """Whether no case was rejected, at least one was judged, and none of the groups that the bench needs is wanting."""
        return bool(self.of(Outcome.ACCEPTED)) and not self.of(Outcome.REJECTED) and not self.wanting
