"""Every axis is enabled for a time, and does not move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.hil_tests.evidence import Evidence, Samples
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding


@dataclass(frozen=True)
class Holds(Expectation):
    """Every drive is in operation enabled for at least `seconds` [s] at a stretch, all at the same time."""

    name: ClassVar[str] = "holds"
    needs_truth: ClassVar[bool] = True
    shorthand: ClassVar[str | None] = "seconds"

    seconds: float

    def judge(self, evidence: Evidence) -> Finding:
        truth = evidence.truth
        held = longest(np.asarray(truth.enabled.all(axis=1)), truth.time)
        if held < self.seconds:
            said = "all drives together were not enabled for as long as the task says"
            return self.fails(said, None, evidence.end, held, self.seconds, "s")
        return MET


def longest(true: NDArray[np.bool_], time: Samples) -> float:
    """Longest stretch (n,) that is true without a break [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2] - 1
    return float((time[ends] - time[starts]).max(initial=0.0)) if len(starts) else 0.0
