"""The gap without and with a patch, on fitted motion and on motion that was not fitted, and what of it noise explains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.diagnosis.prepare.noise import Noise, noise_of
from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.propose.side_by_side import by_key
from drivetwin.diagnosis.report.gap_test import gap_of
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.report.result import Prediction
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Unexplained


@dataclass(frozen=True)
class Gaps:
    """The gap without and with a patch, on both motions, and the noise in it."""

    patch: Patch
    unseen: Sequence[Prediction]
    fitted: Sequence[Prediction]
    noise: Mapping[str, Noise]

    def unexplained(self) -> Unexplained:
        """Shares of what the patch leaves on each axis."""
        left = {axis: max(gap_rms(motion, axis, "after") for motion in (self.unseen, self.fitted)) for axis in self.noise}
        return Unexplained(
            {axis: _beyond(own.rms, left[axis]) for axis, own in self.noise.items()},
            {axis: _beyond(own.floor, left[axis]) for axis, own in self.noise.items()},
        )


def axes_with_gap(ready: Prepared, gaps: Gaps) -> frozenset[str]:
    """Axes on which something is to be found: the simulation as it stands has a gap there, or a second encoder shows a motion.

    More than the noise that the torque shows by itself and the misfit of a calibrated model, by the test of the report.
    """
    return frozenset(
        axis
        for axis, noise in gaps.noise.items()
        if ready.rows.deflects(axis)
        or gap_of(gaps.unseen, gaps.fitted, axis, noise.by_torque, ready.cutoff_hz, noise.misfit).significant
    )


def _beyond(level: float, left: float) -> float:
    """Share of the energy of an rms `left` that is above a level."""
    return 1.0 - min(level / max(left, level, 1e-300), 1.0) ** 2


def gaps_of(ready: Prepared, patch: Patch, settings: Settings) -> Gaps:
    """Of a patch."""
    unseen = [predict(ready.simulation, run, patch) for run in ready.checks]
    fitted = [predict(ready.simulation, run, patch) for run in ready.runs]

    def noise(axis: str) -> Noise:
        parts = [each.axes[axis] for each in (*fitted, *unseen)]
        left = [np.where(part.used, part.measured - part.after, np.nan) for part in parts]
        return noise_of(axis, [*ready.runs, *ready.checks], left, settings, ready.apart.get(axis, 0.0))

    return Gaps(patch, unseen, fitted, by_key(noise, ready.simulation.axes))
