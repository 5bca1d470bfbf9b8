"""No axis moves beyond its target."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.moves import moves, rests


@dataclass(frozen=True)
class Overshoot(Expectation):
    """True way beyond the end of a move, in the direction in which it came, at most `by` [m or rad]."""

    name: ClassVar[str] = "overshoot"
    needs_truth: ClassVar[bool] = True

    by: ByAxis = field(metadata=limit("overshoot"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            made = moves(truth, number)
            if axis not in self.by or not made:
                continue
            beyond = []
            for move, rest in zip(made, rests(truth, number, until_any=False), strict=True):
                whole = slice(move.first, rest.stop)
                target = truth.demand[move.last, number]
                before = truth.demand[max(move.first, move.last - 2), number]
                way = float(np.sign(target - before)) * (truth.position[whole, number] - target)
                beyond.append(float(way.max()))
            worst = int(np.argmax(beyond))
            finding += self.at_most(
                "overshoot",
                max(0.0, beyond[worst]),
                self.by[axis],
                evidence.units[number],
                "the axis goes beyond the end of a move",
                axis,
                float(truth.time[made[worst].last]),
            )
        return finding
