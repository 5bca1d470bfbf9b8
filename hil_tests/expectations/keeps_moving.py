"""The machine works as long as ordered, on all axes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding
from drivetwin.hil_tests.moves import moves

LONGEST_PAUSE = 1.0
"""Between two moves of an axis [s]."""


@dataclass(frozen=True)
class KeepsMoving(Expectation):
    """From the first to the last move of every axis at least `seconds` [s], with no pause above a second."""

    name: ClassVar[str] = "keeps_moving"
    needs_truth: ClassVar[bool] = True
    shorthand: ClassVar[str | None] = "seconds"

    seconds: float

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            made = moves(truth, number)
            lasted = float(truth.time[made[-1].last] - truth.time[made[0].first]) if made else 0.0
            if lasted < self.seconds:
                said = "the axis did not work for as long as the task says"
                finding += self.fails(said, axis, evidence.end, lasted, self.seconds, "s")
            pauses = [float(truth.time[after.first] - truth.time[move.last]) for move, after in pairwise(made)]
            if pauses and max(pauses) > LONGEST_PAUSE:
                said = "the axis paused"
                finding += self.fails(said, axis, evidence.end, max(pauses), LONGEST_PAUSE, "s")
        return finding
