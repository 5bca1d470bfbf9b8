"""The gap without and with a patch, on fitted motion and on motion that was not fitted, and what of it noise explains."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drivetwin.diagnosis.prepare.noise import Noise, noise_of
from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.propose.side_by_side import by_key
from drivetwin.diagnosis.report.gap_test import Errs, GapFound, gap_of
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.report.result import Prediction
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Unexplained


@dataclass(frozen=True)
class Gaps:
    """The gap without and with a patch, on both motions, and the noise in it: `noise` of the unseen motion."""

    patch: Patch
    unseen: Sequence[Prediction]
    fitted: Sequence[Prediction]
    noise: Mapping[str, Noise]
    fitted_noise: Mapping[str, Noise]

    def unexplained(self) -> Unexplained:
        """Shares of what the patch leaves on each axis, on the motion on which that is more."""

        def beyond(axis: str, level: Callable[[Noise], float]) -> float:
            motions = ((self.unseen, self.noise), (self.fitted, self.fitted_noise))
            return max(_beyond(level(noise[axis]), gap_rms(motion, axis, "after")) for motion, noise in motions)

        return Unexplained(
            {axis: beyond(axis, lambda noise: noise.rms) for axis in self.noise},
            {axis: beyond(axis, lambda noise: noise.floor) for axis in self.noise},
        )

    def tested(self, axis: str, cutoff_hz: float, errs: Callable[[Noise], Errs]) -> GapFound:
        """Whether an axis has a gap on either motion, more than the comparison errs by there."""
        own = errs(self.noise[axis]), errs(self.fitted_noise[axis])
        return gap_of(self.unseen, self.fitted, axis, cutoff_hz, *own)

    def with_names(self, axes: Collection[str]) -> Gaps:
        """The same, of which effects explain a small gap on some axes."""
        noise, fitted = (
            {axis: replace(own, is_named=axis in axes) for axis, own in each.items()}
            for each in (self.noise, self.fitted_noise)
        )
        return replace(self, noise=noise, fitted_noise=fitted)


def axes_with_gap(ready: Prepared, gaps: Gaps) -> frozenset[str]:
    """Axes on which something is to be found: the simulation as it stands has a gap there, or a second encoder shows a motion.

    More than the noise that the torque shows by itself and the misfit of a calibrated model, by the test of the report.
    """
    return frozenset(
        axis
        for axis in gaps.noise
        if ready.rows.deflects(axis)
        or gaps.tested(axis, ready.cutoff_hz, lambda noise: Errs(noise.by_torque, noise.misfit)).significant
    )


def _beyond(level: float, left: float) -> float:
    """Share of the energy of an rms `left` that is above a level."""
    return 0.0 if left <= level else 1.0 - (level / left) ** 2


def gaps_of(ready: Prepared, patch: Patch, settings: Settings) -> Gaps:
    """Of a patch."""
    unseen = [predict(ready.simulation, run, patch) for run in ready.checks]
    fitted = [predict(ready.simulation, run, patch) for run in ready.runs]

    def noise(motion: Sequence[Prediction], runs: Sequence[Run], axis: str) -> Noise:
        parts = [each.axes[axis] for each in motion]
        left = [np.where(part.used, part.measured - part.after, np.nan) for part in parts]
        return noise_of(axis, runs, left, settings, ready.apart.get(axis, 0.0))

    own = (by_key(partial(noise, *each), ready.simulation.axes) for each in ((unseen, ready.checks), (fitted, ready.runs)))
    return Gaps(patch, unseen, fitted, *own)
