"""No axis moves, and none is enabled: the controller only observes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit


@dataclass(frozen=True)
class NothingMoves(Expectation):
    """True way of each axis from its first sample at most `by` [m or rad]; without `enabled`, no drive is enabled either."""

    name: ClassVar[str] = "nothing_moves"
    needs_truth: ClassVar[bool] = True

    by: ByAxis = field(metadata=limit("settling_band"))
    enabled: bool = False

    def judge(self, evidence: Evidence) -> Finding:
        finding, position = MET, evidence.truth.position
        for change in evidence.states:
            if change.after is State.OPERATION_ENABLED and not self.enabled:
                finding += self.fails("the drive is enabled", change.axis, change.time)
        for number, axis in enumerate(evidence.axes):
            if axis in self.by and len(position):
                way = np.abs(position[:, number] - position[0, number])
                worst = int(np.argmax(way))
                finding += self.at_most(
                    "way",
                    float(way[worst]),
                    self.by[axis],
                    evidence.units[number],
                    "the axis has moved",
                    axis,
                    float(evidence.truth.time[worst]),
                )
        return finding
