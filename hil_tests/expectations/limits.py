"""Every axis stays within the machine's limits of travel, speed and torque, by the plant's truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.hil_tests.evidence import Evidence, Samples, Truth
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, Ranges, limit
from drivetwin.hil_tests.moves import HOMING


@dataclass(frozen=True)
class Limits(Expectation):
    """True position within `travel` [m or rad] while enabled; |speed| [m/s or rad/s] and |torque| [N·m or N, joint] always.

    An axis that homing has left outside its travel may come in, and is not to leave it again.
    """

    name: ClassVar[str] = "limits"
    needs_truth: ClassVar[bool] = True

    travel: Ranges = field(metadata=limit("travel"))
    speed: ByAxis = field(metadata=limit("speed"))
    torque: ByAxis = field(metadata=limit("torque"))

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        for number, axis in enumerate(evidence.axes):
            unit = evidence.units[number]
            if axis in self.travel and len(truth.time):
                low, high = self.travel[axis]
                position = truth.position[:, number]
                beyond = np.maximum(low - position, position - high)
                outside = np.where(_has_come_in(truth, number, beyond <= 0.0), beyond, -np.inf)
                worst = int(np.argmax(outside))
                if outside[worst] > 0.0:
                    bound = low if position[worst] < low else high
                    said = f"the axis leaves its travel of {low:g} .. {high:g} {unit}"
                    finding += self.fails(said, axis, float(truth.time[worst]), float(position[worst]), bound, unit)
            if axis in self.speed:
                said = "the axis is too fast"
                finding += self._most(evidence, "speed", truth.velocity[:, number], self.speed[axis], f"{unit}/s", said, axis)
            if axis in self.torque:
                said = "the motor gives more than the axis may have"
                torque_unit = "N" if unit == "m" else "N·m"
                finding += self._most(evidence, "torque", truth.torque[:, number], self.torque[axis], torque_unit, said, axis)
        return finding

    def _most(
        self, evidence: Evidence, name: str, values: Samples, limit: float, unit: str, message: str, axis: str
    ) -> Finding:
        if not len(values):
            return MET
        worst = int(np.argmax(np.abs(values)))
        time = float(evidence.truth.time[worst])
        return self.at_most(name, float(abs(values[worst])), limit, unit, message, axis, time)


def _has_come_in(truth: Truth, axis: int, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where the axis is enabled and has been inside its travel since it was homed last (n,)."""
    homing = truth.mode[:, axis] == HOMING
    used = truth.enabled[:, axis] & ~homing
    comes_in = np.cumsum(used & inside)
    at_homing = np.maximum.accumulate(np.where(homing, comes_in, 0))
    return np.asarray(used & (comes_in > at_homing))
