"""No demand jumps: not when a drive is enabled, not at a change of mode, not in motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import Evidence, Samples, Truth
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.moves import commanded

WINDOW = 0.1
"""How long after an enabling the plant is watched [s]."""

MARGIN = 1.1
"""A demand may go by this much of the axis's greatest speed in a cycle."""


@dataclass(frozen=True)
class NoJump(Expectation):
    """The demand goes no further in a cycle than at `speed` [m/s or rad/s], and the axis leaves it by `after_enabling`
    [m or rad] at most in the 0.1 s after an enabling."""

    name: ClassVar[str] = "no_jump"
    needs_truth: ClassVar[bool] = True

    speed: ByAxis = field(metadata=limit("speed"))
    after_enabling: ByAxis = field(metadata=limit("enable_jump"))

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for number, axis in enumerate(evidence.axes):
            finding += self._steps(evidence, number, axis) + self._enablings(evidence, number, axis)
        return finding

    def _steps(self, evidence: Evidence, number: int, axis: str) -> Finding:
        truth, unit = evidence.truth, evidence.units[number]
        if axis not in self.speed or len(truth.time) < 2:
            return MET
        follows = commanded(truth, number)
        demand = truth.demand[:, number]
        began = np.where(follows[:-1], demand[:-1], truth.position[:-1, number])  # from where it was let go
        steps = np.where(follows[1:], np.abs(demand[1:] - began), 0.0)
        speeds = np.maximum(steps, _into_a_fault(truth, number, follows)) / np.diff(truth.time)
        worst, most = int(np.argmax(speeds)), MARGIN * self.speed[axis]
        if speeds[worst] <= most:
            return MET
        step = f"{speeds[worst] * (truth.time[worst + 1] - truth.time[worst]):.4g} {unit}"
        return self.fails(
            f"the position demand leaps by {step} in one cycle", axis, truth.time[worst + 1], speeds[worst], most, f"{unit}/s"
        )

    def _enablings(self, evidence: Evidence, number: int, axis: str) -> Finding:
        truth, finding = evidence.truth, MET
        if axis not in self.after_enabling:
            return MET
        for change in evidence.states:
            if change.axis != axis or change.after is not State.OPERATION_ENABLED:
                continue
            window = truth.between(change.time, change.time + WINDOW)
            follows = truth.enabled[window, number] & truth.positioning[window, number]
            away = np.abs(truth.demand[window, number] - truth.position[window, number])[follows]
            if len(away):
                finding += self.at_most(
                    "jump at enabling",
                    float(away.max()),
                    self.after_enabling[axis],
                    evidence.units[number],
                    "the axis jumps when its drive is enabled",
                    axis,
                    change.time,
                )
        return finding


def _into_a_fault(truth: Truth, axis: int, follows: NDArray[np.bool_]) -> Samples:
    """Steps (n - 1,) of a demand to which the drive answered by a fault in the same cycle, 0 elsewhere [m or rad].

    A drive that stops for another reason takes up its demand where the axis is: that is no step.
    """
    demand = truth.demand[:, axis]
    step = np.minimum(np.abs(np.diff(demand)), np.abs(demand[1:] - truth.position[1:, axis]))
    return np.where(follows[:-1] & ~follows[1:] & truth.positioning[1:, axis], step, 0.0)
