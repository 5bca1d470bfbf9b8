"""After each move the axis reaches its band in time, and stays in it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.foundation.quantities import quantity
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit
from drivetwin.hil_tests.moves import Move, moves, rests


@dataclass(frozen=True)
class Settling(Expectation):
    """From the end of the demand's move to where the true position stays within `band` [m or rad] of it, until an axis moves
    again: at most `time` [s]. Where it rests for less than that, or is let go before, nothing can be said.
    """

    name: ClassVar[str] = "settling"
    needs_truth: ClassVar[bool] = True

    time: float = field(metadata=limit("settling_time"))
    band: ByAxis = field(metadata=limit("settling_band"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            made = moves(truth, number)
            if axis not in self.band or not made:
                continue
            times: list[tuple[float, Move]] = []
            for move, rest in zip(made, rests(truth, number, until_any=True), strict=True):
                target = truth.demand[move.last, number]
                outside = np.flatnonzero(np.abs(truth.position[rest, number] - target) > self.band[axis])
                settled = 0 if not len(outside) else int(outside[-1]) + 1
                if settled < rest.stop - rest.start:
                    times.append((float(truth.time[rest][settled] - truth.time[move.last]), move))
                elif truth.time[rest.stop - 1] - truth.time[move.last] >= self.time:
                    times.append((np.inf, move))
            if not times:
                continue
            worst, after = max(times, key=lambda one: one[0])
            band = quantity(self.band[axis], evidence.units[number])
            finding += self.at_most(
                "settling time",
                worst,
                self.time,
                "s",
                f"the axis is not within {band} of its target in time after a move",
                axis,
                float(truth.time[after.last]),
            )
        return finding
