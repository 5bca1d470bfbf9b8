"""Every axis is homed: the drive's zero is the machine's true zero."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit


@dataclass(frozen=True)
class Homed(Expectation):
    """True joint position at the drive's position 0, at most `error` [m or rad] from 0, when the controller ends."""

    name: ClassVar[str] = "homed"
    needs_truth: ClassVar[bool] = True

    error: ByAxis = field(metadata=limit("homing_error"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        last = truth.between(-1.0, evidence.end).stop - 1
        for number, axis in enumerate(evidence.axes):
            if axis not in self.error:
                continue
            if last < 0:
                finding += self.fails("no time has passed: the axis cannot have homed", axis)
                continue
            finding += self.at_most(
                "homing error",
                abs(float(truth.zero[last, number])),
                self.error[axis],
                evidence.units[number],
                "the drive's zero is not where the machine's is",
                axis,
                evidence.end,
            )
        return finding
