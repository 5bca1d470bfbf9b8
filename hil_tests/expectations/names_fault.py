"""The controller names the node that caused the stop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding
from drivetwin.hil_tests.expectations.identification import read_json

FILE = "controller.json"


@dataclass(frozen=True)
class NamesFault(Expectation):
    """`node` of controller.json (controller/1) at the last start, and a reason."""

    name: ClassVar[str] = "names_fault"
    needs_truth: ClassVar[bool] = False
    shorthand: ClassVar[str | None] = "node"

    node: float

    def judge(self, evidence: Evidence) -> Finding:
        told = None if evidence.out is None else read_json(evidence.out / FILE)
        if not isinstance(told, dict):
            return self.fails(f"the controller wrote no {FILE} (controller/1)", None, evidence.end)
        if told.get("node") != self.node or not told.get("reason"):
            axis = dict(zip(evidence.nodes, evidence.axes, strict=True)).get(int(self.node))
            said = f"the controller says node {told.get('node')}: {told.get('reason')!r}; it was node {self.node:g}"
            return self.fails(said, axis, evidence.end)
        return MET
