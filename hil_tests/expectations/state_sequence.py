"""Drives are enabled step by step through the states of CiA 402, and none has a fault unless one was injected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.drive.state_machine import State
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding

_STEPS = {
    State.READY_TO_SWITCH_ON: (State.SWITCH_ON_DISABLED, State.SWITCHED_ON, State.OPERATION_ENABLED),
    State.SWITCHED_ON: (State.READY_TO_SWITCH_ON, State.OPERATION_ENABLED),
    State.OPERATION_ENABLED: (State.SWITCHED_ON, State.QUICK_STOP_ACTIVE),
}
"""States that lead to each by one transition (CiA 402-2, figure 'State machine'): 2, 6, 8; 3, 5; 4, 16."""


@dataclass(frozen=True)
class StateSequence(Expectation):
    """Each drive reaches operation enabled by ready to switch on and switched on, each of them seen.

    With `times` exactly that often. In what state a drive begins is no step, and enables none.
    """

    name: ClassVar[str] = "state_sequence"
    needs_truth: ClassVar[bool] = False

    times: float | None = None

    def judge(self, evidence: Evidence) -> Finding:
        finding = MET
        for axis in evidence.axes:
            steps = [(one, one.before) for one in evidence.states if one.axis == axis and one.before is not None]
            for change, before in steps:
                if before not in _STEPS.get(change.after, (before,)):
                    went = f"{_words(before)} to {_words(change.after)}"
                    finding += self.fails(f"the drive went from {went}: a step was left out", axis, change.time)
                if change.after is State.FAULT and not any(struck.time is not None for struck in evidence.struck):
                    finding += self.fails("the drive is in a fault, and none was injected", axis, change.time)
            enabled = sum(change.after is State.OPERATION_ENABLED for change, _ in steps)
            if self.times is not None and enabled != self.times:
                said = f"the drive was enabled {enabled} times, expected {self.times:g}"
                finding += self.fails(said, axis, evidence.end, float(enabled), self.times)
            elif not enabled:
                finding += self.fails("the drive was never enabled", axis, evidence.end)
        return finding


def _words(state: State) -> str:
    return state.name.lower().replace("_", " ")
