"""No SDO is sent while axes follow streamed set-points: it would cost time in the cycle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding
from drivetwin.hil_tests.moves import moves


@dataclass(frozen=True)
class NoSdoWhileStreaming(Expectation):
    """No SDO request of the controller while an axis follows a changing position demand, homing left out; `most` are borne."""

    name: ClassVar[str] = "no_sdo_while_streaming"
    needs_truth: ClassVar[bool] = True

    most: float = 0.0

    def judge(self, evidence: Evidence) -> Finding:
        truth = evidence.truth
        streaming = np.zeros(len(truth.time), dtype=np.bool_)
        for number in range(len(evidence.axes)):
            for move in moves(truth, number):
                streaming[move.first + 1 : move.last] = True
        requests = [frame for frame in evidence.frames if frame.by_controller and 0x600 < frame.identifier < 0x680]
        places = np.searchsorted(truth.time, [frame.time for frame in requests])
        within = [frame for frame, place in zip(requests, places, strict=True) if place < len(streaming) and streaming[place]]
        if len(within) > self.most:
            node = within[0].identifier - 0x600
            said = f"{len(within)} SDO requests between set-points, the first to node {node}"
            return self.fails(said, None, within[0].time, float(len(within)), self.most)
        return MET
