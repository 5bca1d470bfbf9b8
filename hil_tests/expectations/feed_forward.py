"""Torque feed-forward is as effective as in the last release: one motion without and with it, by the plant's truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence, Truth
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.moves import Move, moves

SAME = 1e-5
"""Two demands are the same motion where they differ by no more than this [m or rad]."""


@dataclass(frozen=True)
class FeedForward(Expectation):
    """rms of (demand - true position) over the moves with a torque offset, over that of the same moves without one: at most
    `ratio`. The moves are found by the drives' own 60B2h and demand."""

    name: ClassVar[str] = "feed_forward"
    needs_truth: ClassVar[bool] = True

    ratio: ByAxis = field(metadata=limit("feed_forward_ratio"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            if axis not in self.ratio:
                continue
            pairs = _pairs(truth, number)
            if not pairs:
                said = "there is no motion that was made without and with a torque offset (60B2h)"
                finding += self.fails(said, axis, evidence.end)
                continue
            without, with_it = (_rms(truth, number, [pair[which] for pair in pairs]) for which in (0, 1))
            message = "feed-forward of torque does not lessen the tracking error as it has to"
            quantity = "tracking error with feed-forward over without"
            finding += self.at_most(quantity, with_it / without, self.ratio[axis], "1", message, axis, evidence.end)
        return finding


def _pairs(truth: Truth, axis: int) -> list[tuple[Move, Move]]:
    """Each move with an offset, and the one of the same demand without."""
    made = moves(truth, axis)
    fed = [bool(np.any(truth.offset[move.samples, axis] != 0.0)) for move in made]
    plain = [move for move, with_it in zip(made, fed, strict=True) if not with_it]
    pairs = []
    for move, with_it in zip(made, fed, strict=True):
        same = next((other for other in plain if _same(truth, axis, other, move)), None) if with_it else None
        if same is not None:
            pairs.append((same, move))
    return pairs


def _same(truth: Truth, axis: int, one: Move, other: Move) -> bool:
    if one.last - one.first != other.last - other.first:
        return False
    return bool(np.allclose(truth.demand[one.samples, axis], truth.demand[other.samples, axis], rtol=0.0, atol=SAME))


def _rms(truth: Truth, axis: int, of: list[Move]) -> float:
    errors = [truth.demand[move.samples, axis] - truth.position[move.samples, axis] for move in of]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
