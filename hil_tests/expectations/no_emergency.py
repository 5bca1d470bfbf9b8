"""No drive sends an emergency message."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding


@dataclass(frozen=True)
class NoEmergency(Expectation):
    """No EMCY with an error code (CiA 301, 7.2.7) while the controller is there."""

    name: ClassVar[str] = "no_emergency"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for frame in evidence.frames:
            node = frame.identifier - 0x80
            if node not in evidence.nodes or frame.by_controller or len(frame.data) < 2 or frame.time > evidence.end:
                continue
            code = int.from_bytes(frame.data[:2], "little")
            if code:
                axis = evidence.axes[evidence.nodes.index(node)]
                finding += self.fails(f"node {node} tells EMCY {code:04X}h", axis, frame.time)
        return finding
