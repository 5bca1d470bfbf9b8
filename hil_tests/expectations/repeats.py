"""A repeated motion turns at the same positions at its end as at its beginning."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.hil_tests.evidence import Evidence, Samples, Truth
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.moves import STANDS, moves


@dataclass(frozen=True)
class Repeats(Expectation):
    """True positions at which an axis turns back, by its demand, differ by at most `by` [m or rad] on each of its two sides.

    For a task whose axes go to and fro between two places; the way to the first of them is left out.
    """

    name: ClassVar[str] = "repeats"
    needs_truth: ClassVar[bool] = True

    by: ByAxis = field(metadata=limit("settling_band"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            if axis not in self.by:
                continue
            turns = _turns(truth, number)
            if len(turns) < 4:
                finding += self.fails(f"the axis turned back {len(turns)} times, too few to compare", axis, evidence.end)
                continue
            spread, when = max(_spread(truth.position[:, number], side) for side in (turns[::2], turns[1::2]))
            finding += self.at_most(
                "spread of turning points",
                spread,
                self.by[axis],
                evidence.units[number],
                "the axis does not come back to where it was",
                axis,
                float(truth.time[when]),
            )
        return finding


def _turns(truth: Truth, axis: int) -> NDArray[np.intp]:
    """Samples (n,) at which the demand turns back, from the first move that the axis was told to the last."""
    made = moves(truth, axis)
    if not made:
        return np.array([], dtype=np.intp)
    steps = np.diff(truth.demand[made[0].first : made[-1].last + 1, axis])
    moving = np.flatnonzero(np.abs(steps) > STANDS)
    signs = np.sign(steps[moving])
    return np.asarray(made[0].first + moving[1:][signs[1:] != signs[:-1]])


def _spread(position: Samples, turns: NDArray[np.intp]) -> tuple[float, int]:
    """Greatest less smallest true position at some samples, and the sample furthest from the first one."""
    at = position[turns]
    return float(np.ptp(at)), int(turns[np.argmax(np.abs(at - at[0]))])
