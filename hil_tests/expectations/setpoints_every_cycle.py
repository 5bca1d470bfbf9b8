"""A drive that follows set-points receives one in every cycle, before the SYNC at which it takes effect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding
from drivetwin.hil_tests.moves import moves

RPDO_1 = 0x200
SYNC_COB_ID = 0x80


@dataclass(frozen=True)
class SetpointsEveryCycle(Expectation):
    """RPDO 1 of each node between any two SYNCs of a move; `missing` are borne, in all."""

    name: ClassVar[str] = "setpoints_every_cycle"
    needs_truth: ClassVar[bool] = True

    missing: float = 0.0

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        cycles = _cycles(evidence)
        for number, (axis, node) in enumerate(zip(evidence.axes, evidence.nodes, strict=True)):
            bare = np.array([time for time, nodes in cycles if node not in nodes])
            missed = [
                time
                for move in moves(truth, number)
                for time in bare[(bare > truth.time[move.first]) & (bare < truth.time[move.last - 1])].tolist()
            ]
            if len(missed) > self.missing:
                said = f"{len(missed)} cycles of a move without a set-point (RPDO 1 of node {node})"
                finding += self.fails(said, axis, missed[0], float(len(missed)), self.missing)
        return finding


def _cycles(evidence: Evidence) -> list[tuple[float, frozenset[int]]]:
    """The time of each SYNC, and the nodes whose RPDO 1 came since the one before."""
    cycles, nodes = [], set()
    for frame in evidence.frames:
        if not frame.by_controller:
            continue
        if RPDO_1 < frame.identifier < RPDO_1 + 0x80:
            nodes.add(frame.identifier - RPDO_1)
        elif frame.identifier == SYNC_COB_ID:
            cycles.append((frame.time, frozenset(nodes)))
            nodes.clear()
    return cycles
