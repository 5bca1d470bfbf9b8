"""Every node is operational at the end of the task, and was never set to a lower state meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding


@dataclass(frozen=True)
class Operational(Expectation):
    """NMT state operational (CiA 301, 7.3.2.2) of each node when the controller ends."""

    name: ClassVar[str] = "operational"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            if axis not in evidence.operational:
                finding += self.fails(f"node {node} is not operational when the controller ends", axis, evidence.end)
        return finding
