"""6072h limits each real drive's torque to the limits file given to the controller; the drive's value counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence, TorqueLimit
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding

ROUNDING = 1e-9
"""Relative; of a limit that was converted to thousandths and back."""


@dataclass(frozen=True)
class TorqueLimitKept(Expectation):
    """6072h of each drive at its start, and whenever it is changed afterwards, at most the torque of `real.limits`.

    Virtual drives have no limits file, and meet this.
    """

    name: ClassVar[str] = "torque_limit_kept"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        nodes = dict(zip(evidence.axes, evidence.nodes, strict=True))
        for axis, bounds in evidence.bench.real_limits.items():
            unit = "N" if evidence.bench.units[axis] == "m" else "N·m"
            told = [one for one in evidence.torque_limits if one.axis == axis]
            finding += self._of_one(nodes[axis], axis, told, bounds.torque, unit)
        return finding

    def _of_one(self, node: int, axis: str, told: Sequence[TorqueLimit], allowed: float, unit: str) -> Finding:
        """What is found of an axis that may give `allowed` [N or N·m]: the first that is wrong."""
        if not told:
            said = f"node {node} was never started, and nobody knows its 6072h"
            return self.fails(said, axis, limit=allowed, unit=unit)
        for one in told:
            if one.torque is None:
                said = f"the controller neither wrote nor read back 6072h of node {node} before it started it"
                return self.fails(said, axis, one.time, limit=allowed, unit=unit)
            if one.torque > allowed * (1.0 + ROUNDING):
                said = f"node {node} may give more than real.limits say (6072h)"
                return self.fails(said, axis, one.time, one.torque, allowed, unit)
        return MET
