"""After the controller has ended, each drive reports that it is not enabled; a silent drive fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding

ENABLED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
"""States in which the power stage is on (CiA 402-2, figure 'State machine')."""


@dataclass(frozen=True)
class TellsDisabled(Expectation):
    """Its state when the controller ends, and later, as the drive tells it: what the next case relies on."""

    name: ClassVar[str] = "tells_disabled"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for axis, node in zip(evidence.axes, evidence.nodes, strict=True):
            if evidence.told is not None and axis not in evidence.told:
                finding += self.fails(f"no frame showed the state of node {node} since it booted", axis, evidence.end)
                continue
            changes = [change for change in evidence.states if change.axis == axis]
            last = [change for change in changes if change.time <= evidence.end][-1:]
            for change in last + [change for change in changes if change.time > evidence.end]:
                if change.after in ENABLED:
                    state = change.after.name.lower().replace("_", " ")
                    finding += self.fails(f"the controller has gone, and the drive tells {state}", axis, change.time)
        return finding
