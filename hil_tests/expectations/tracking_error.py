"""The true distance of an axis from its drive's demand, while it follows positions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.moves import commanded, moves


@dataclass(frozen=True)
class TrackingError(Expectation):
    """Greatest |position demand - true position| at most `most` [m or rad], homing left out; `rms` over all moves is told."""

    name: ClassVar[str] = "tracking_error"
    needs_truth: ClassVar[bool] = True

    most: ByAxis = field(metadata=limit("tracking_error"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            made = moves(truth, number)
            if axis not in self.most or not made:
                continue
            error = np.where(commanded(truth, number), np.abs(truth.demand[:, number] - truth.position[:, number]), 0.0)
            worst = int(np.argmax(error))
            finding += self.at_most(
                "tracking error",
                float(error[worst]),
                self.most[axis],
                evidence.units[number],
                "the axis does not follow its demand",
                axis,
                float(truth.time[worst]),
            )
        return finding
