"""When the controller ends, every axis is at rest and no drive is enabled."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit


@dataclass(frozen=True)
class DisabledAtEnd(Expectation):
    """No drive in operation enabled, and true |speed| at most `speed` [m/s or rad/s], once the controller has gone.

    `except_for` are axes whose drives it could not reach.
    """

    name: ClassVar[str] = "disabled_at_end"
    needs_truth: ClassVar[bool] = True

    speed: ByAxis = field(metadata=limit("stop_speed"))
    except_for: tuple[str, ...] = ()

    def judge(self, evidence: Evidence) -> Finding:
        truth, finding = evidence.truth, MET
        window = truth.between(evidence.end, np.inf)
        for number, axis in enumerate(evidence.axes):
            if axis in self.except_for:
                continue
            time = truth.time[window]
            if truth.enabled[window, number].any():
                first = int(np.argmax(truth.enabled[window, number]))
                finding += self.fails("the controller has gone and the drive is enabled", axis, float(time[first]))
            speed = np.abs(truth.velocity[window, number])
            if axis in self.speed and len(speed) and speed.max() > self.speed[axis]:
                worst = int(np.argmax(speed))
                unit = f"{evidence.units[number]}/s"
                said = "the controller has gone and the axis moves"
                finding += self.fails(said, axis, float(time[worst]), float(speed[worst]), self.speed[axis], unit)
        return finding
