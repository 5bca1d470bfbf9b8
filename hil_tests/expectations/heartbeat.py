"""Every node produces a heartbeat, and detects the loss of its master."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding, limit


@dataclass(frozen=True)
class Heartbeat(Expectation):
    """Producer heartbeat time (1017h) above 0 and at most `period` [s], and with `supervised` a supervision of the master:
    1016h, life guarding, or what the drive type has of its own."""

    name: ClassVar[str] = "heartbeat"
    needs_truth: ClassVar[bool] = False

    period: float = field(metadata=limit("heartbeat_period"))
    supervised: bool = True

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            configured = evidence.configured.get(axis)
            if configured is None:
                finding += self.fails(f"node {node} never became operational", axis)
                continue
            time, beat = configured.time, configured.heartbeat
            if not beat:
                finding += self.fails(f"node {node} produces no heartbeat (1017h is 0)", axis, time, 0.0, self.period, "s")
            else:
                message = f"node {node} produces a heartbeat too seldom (1017h)"
                finding += self.at_most("heartbeat period", beat, self.period, "s", message, axis, time)
            if self.supervised and not configured.supervises:
                said = f"node {node} does not notice when its master has gone (1016h, life guarding, or a SYNC time-out)"
                finding += self.fails(said, axis, time)
        return finding
