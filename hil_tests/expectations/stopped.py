"""After a fault every axis comes to rest in time, and stays there."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, ByAxis, Expectation, Finding, limit


@dataclass(frozen=True)
class Stopped(Expectation):
    """True |speed| of every axis at most `speed` [m/s or rad/s] from `within` [s] after the first fault on, for good.

    With `during` [s] only for that long: a controller that resumes moves again. `except_for` are axes that nobody can stop (a
    motor without torque under a load). Of a watch that ended sooner its end counts.
    """

    name: ClassVar[str] = "stopped"
    needs_truth: ClassVar[bool] = True

    within: float = field(metadata=limit("stop_time"))
    speed: ByAxis = field(metadata=limit("stop_speed"))
    during: float | None = None
    except_for: tuple[str, ...] = ()

    def judge(self, evidence: Evidence) -> Finding:
        struck, truth, finding = evidence.fault_time, evidence.truth, MET
        if struck is None:
            return MET  # that a fault never struck is told by itself
        until = np.inf if self.during is None else struck + self.within + self.during
        window = truth.between(struck, until)
        too_short = truth.ends_before(struck + self.within)
        for number, axis in enumerate(evidence.axes):
            if axis in self.except_for or axis not in self.speed:
                continue
            moving = np.flatnonzero(np.abs(truth.velocity[window, number]) > self.speed[axis])
            if too_short and abs(truth.velocity[-1, number]) > self.speed[axis]:
                end = float(truth.time[-1])
                watched = f"the watch ended {end - struck:.3g} s after the fault, before {self.within:g} s were over"
                finding += self.fails(f"{watched}, and the axis still moved", axis, end)
            last = float(truth.time[window][moving[-1]]) if len(moving) else struck
            finding += self.at_most(
                "time to rest", last - struck, self.within, "s", "the axis is not at rest in time after the fault", axis, last
            )
        return finding
