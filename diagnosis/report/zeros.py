"""Validation recordings whose position has a zero of its own: moved to where what was found gives their torque best.

What was fitted has an absolute position, or one within a turn of the motor (`prepare/turns.py`). Where the model's torque tells
no zero, as on a level slide, an effect of the position would be judged at a wrong place.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from drivetwin.diagnosis.prepare.positions import zeros_within
from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.emulator.effects import Need

TRIED = 400
"""Zeros over an axis's range, before the best is moved: a shorter wave than a hundredth of the range is not placed."""


def placed_by(ready: Prepared, patch: Patch) -> Prepared:
    """The same, each validation recording that is adrift placed by the patch's effects of the position; with a note of each."""
    told = {one.axis for one in patch.effects if one.effect.needs & {Need.ABSOLUTE_POSITION, Need.MOTOR_ANGLE}}
    checks, notes = [], []
    for run in ready.checks:
        zeros = {axis: _zero(ready, run, patch, axis) for axis in ready.adrift.get(run.recording.name, ()) if axis in told}
        checks.append(run.placed(zeros) if zeros else run)
        for axis, zero in zeros.items():
            at = f"{axis} {zero:+.3g} {'m' if ready.simulation.slides(axis) else 'rad'}"
            notes.append(f"{run.recording.name}: the position is relative; by what was found its zero is at {at}.")
    return replace(ready, checks=checks, notes=(*ready.notes, *notes))


def _zero(ready: Prepared, run: Run, patch: Patch, axis: str) -> float:
    """Zero [rad or m] with which least of the axis's gap is left; that of the recording where no other is better."""
    own = replace(patch, effects=tuple(one for one in patch.effects if one.axis == axis), heavier=None)
    low, high = zeros_within(ready.simulation, axis, run.axes[axis].motion.position)

    def left(zero: float) -> float:
        return gap_rms([predict(ready.simulation, run.placed({axis: zero}), own)], axis, "after")

    tried = np.append(np.linspace(low, high, TRIED), 0.0)
    best = float(min(tried, key=left))
    step = (high - low) / (TRIED - 1)
    near = minimize_scalar(left, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-3 * step})
    return float(near.x) if left(float(near.x)) < left(best) else best
