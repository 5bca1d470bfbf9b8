"""The controller sends no more than a cycle needs."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import ClassVar

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import Expectation, Finding, limit

CYCLIC = (*range(0x200, 0x280), *range(0x300, 0x380), *range(0x400, 0x480), *range(0x500, 0x580))
"""RPDOs (CiA 301, 7.3.3)."""


@dataclass(frozen=True)
class NoFlood(Expectation):
    """From the first SYNC on at most `frames` of the controller between two SYNCs, SDO and NMT left out, and no RPDO twice."""

    name: ClassVar[str] = "no_flood"
    needs_truth: ClassVar[bool] = False

    frames: float = field(metadata=limit("frames_per_cycle"))

    def judge(self, evidence: Evidence) -> Finding:
        most, when, twice = 0, 0.0, None
        counted: Counter[int] | None = None
        for frame in evidence.frames:
            if not frame.by_controller:
                continue
            if frame.identifier == 0x80:
                counted = Counter()
            elif counted is not None and not _waits(frame.identifier):
                counted[frame.identifier] += 1
                if frame.identifier in CYCLIC and counted[frame.identifier] == 2 and twice is None:
                    twice = frame
                if counted.total() > most:
                    most, when = counted.total(), frame.time
        finding = self.at_most("frames a cycle", float(most), self.frames, "1", "too many frames between two SYNCs", None, when)
        if twice is not None:
            finding += self.fails(f"RPDO {twice.identifier:03X}h was sent twice between two SYNCs", None, twice.time)
        return finding


def _waits(identifier: int) -> bool:
    """NMT, SDO requests, LSS: of no cycle."""
    return identifier == 0 or 0x600 < identifier < 0x680 or identifier >= 0x7E4
