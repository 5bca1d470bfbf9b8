"""The gap without and with a patch, on fitted motion and on motion that was not fitted, and what of it noise explains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.diagnosis.prepare.noise import Noise, noise_of
from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.report.result import Prediction
from drivetwin.diagnosis.settings import Settings


@dataclass(frozen=True)
class Gaps:
    """The gap without and with a patch, on both motions, and the noise in it."""

    patch: Patch
    unseen: Sequence[Prediction]
    fitted: Sequence[Prediction]
    noise: Mapping[str, Noise]

    def systematic(self) -> dict[str, float]:
        """Share of the energy that the patch leaves on each axis which is neither noise nor what the comparison errs by."""
        left = {axis: max(gap_rms(motion, axis, "after") for motion in (self.unseen, self.fitted)) for axis in self.noise}
        return {axis: 1.0 - min(own.floor / max(left[axis], own.floor, 1e-300), 1.0) ** 2 for axis, own in self.noise.items()}


def gaps_of(ready: Prepared, patch: Patch, settings: Settings) -> Gaps:
    """Of a patch."""
    unseen = [predict(ready.simulation, run, patch) for run in ready.checks]
    fitted = [predict(ready.simulation, run, patch) for run in ready.runs]
    noise = {}
    for axis in ready.simulation.axes:
        parts = [each.axes[axis] for each in (*fitted, *unseen)]
        left = [np.where(part.used, part.measured - part.after, np.nan) for part in parts]
        noise[axis] = noise_of(axis, [*ready.runs, *ready.checks], left, settings.model_error, ready.apart.get(axis, 0.0))
    return Gaps(patch, unseen, fitted, noise)
