"""After a fault no drive is left enabled, and none is enabled again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding, limit


@dataclass(frozen=True)
class StaysDisabled(Expectation):
    """No drive is in operation enabled from `within` [s] after the last fault on; of a watch that ended sooner, at its end."""

    name: ClassVar[str] = "stays_disabled"
    needs_truth: ClassVar[bool] = True

    within: float = field(metadata=limit("disable_time"))

    def judge(self, evidence: Evidence) -> Finding:
        struck, truth, finding = evidence.last_fault_time, evidence.truth, MET
        if struck is None:
            return MET  # that a fault never struck is told by itself
        begin = struck + self.within
        window = truth.between(begin, np.inf)
        too_short = truth.ends_before(begin)
        for number, axis in enumerate(evidence.axes):
            if too_short and truth.enabled[-1, number]:
                end = float(truth.time[-1])
                watched = f"the watch ended {end - struck:.3g} s after the fault, before {self.within:g} s were over"
                finding += self.fails(f"{watched}, and the drive was still enabled", axis, end)
            enabled = np.flatnonzero(truth.enabled[window, number])
            if len(enabled):
                time = float(truth.time[window][enabled[0]])
                finding += self.fails("the drive is enabled long after the fault", axis, time, time - struck, self.within, "s")
        return finding
