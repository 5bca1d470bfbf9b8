"""SYNC has the ordered period; in real time, with limited jitter."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding, limit

SYNC_COB_ID = 0x80


@dataclass(frozen=True)
class SyncPeriod(Expectation):
    """In lockstep every SYNC moves time by the bench's cycle: the drives were told it (1006h).

    In real time and with bit timing 99 % of the SYNCs come within `jitter` [s] of a cycle after the one before, by the wall
    clock or the wire's.
    """

    name: ClassVar[str] = "sync_period"
    needs_truth: ClassVar[bool] = False

    jitter: float = field(metadata=limit("sync_jitter"))

    def judge(self, evidence: Evidence) -> Finding:
        cycle = evidence.bench.cycle
        syncs = [frame for frame in evidence.frames if frame.identifier == SYNC_COB_ID and frame.by_controller]
        if len(syncs) < 2:
            return self.fails("there are no two SYNCs", None, evidence.end)
        heard = np.array([frame.heard if evidence.timed else frame.time for frame in syncs])
        away = np.abs(np.diff(heard) - cycle)
        if evidence.timed:
            message = f"SYNC does not come every {1e3 * cycle:g} ms"
            return self.at_most("SYNC jitter, 99 %", float(np.quantile(away, 0.99)), self.jitter, "s", message)
        worst = int(np.argmax(away))
        if away[worst] > 1e-9:
            period = float(heard[worst + 1] - heard[worst])
            said = "SYNCs are a cycle apart that was not ordered"
            return self.fails(said, None, float(syncs[worst].time), period, cycle, "s")
        return MET
