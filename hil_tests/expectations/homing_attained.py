"""Every real drive has completed homing in this case; replaces `homed` where the true zero is unknown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding


@dataclass(frozen=True)
class HomingAttained(Expectation):
    """Homing started in mode 6 (controlword bit 4), and bit 12 of the statusword risen after it, without bit 13, in each drive.

    Virtual drives meet this: `homed` holds their zero against the plant's.
    """

    name: ClassVar[str] = "homing_attained"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        if evidence.homed is None:
            return finding
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            if axis not in evidence.homed:
                finding += self.fails(f"no frame showed that node {node} has homed: mode 6, start, homing attained", axis)
        return finding
