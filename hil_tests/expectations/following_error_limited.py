"""Every drive has a limit on its following error: it stops by itself if the axis does not follow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding


@dataclass(frozen=True)
class FollowingErrorLimited(Expectation):
    """The drive's own limit (6065h, or what its type has for it) is set when the node becomes operational; a type without one
    meets this."""

    name: ClassVar[str] = "following_error_limited"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            configured = evidence.configured.get(axis)
            if configured is None:
                finding += self.fails(f"node {node} never became operational", axis)
            elif configured.limits_following_error is False:
                said = f"node {node} supervises no following error: the limit of its drive is off"
                finding += self.fails(said, axis, configured.time)
        return finding
