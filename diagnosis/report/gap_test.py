"""Is a gap more than noise: a test that knows how many independent values filtered noise has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from drivetwin.diagnosis.report.prediction import gap_rms
from drivetwin.diagnosis.report.result import Prediction
from drivetwin.motion.filtering import effective_cutoff

NAME = (
    "one-sided chi-square test of the gap's mean square against the noise's, on the validation and on the fitted motion; "
    "p is twice the smaller of the two"
)

NOISE_KNOWN_TO = 0.25
"""Relative error of a noise level that is told from a spectrum or a few repetitions; the test allows for it."""
SMALLEST_SHARE_OF_TORQUE = 0.002
"""Of the torque's rms: a gap below is no machine's but arithmetic's, a filter's or a rounding's."""
SIGNIFICANT = 0.01
"""p-value below which there is a gap."""
BANDWIDTH = 1.0
"""Statistical bandwidth of the zero-phase filter in cut-offs, (int S)² / int S²: two passes of a 4th-order Butterworth."""


@dataclass(frozen=True)
class Errs:
    """By how much a comparison errs on some motion, rms [N·m or N]: its noise, and what it is said to miss besides."""

    noise: float
    misfit: float = 0.0

    @property
    def rms(self) -> float:
        """Both together."""
        return float(np.hypot(self.noise, self.misfit))

    @property
    def allowed(self) -> float:
        """What is no gap: noise as large as it may be, and the misfit."""
        return float(np.hypot((1.0 + NOISE_KNOWN_TO) * self.noise, self.misfit))

    def with_as_much(self, level: float, elsewhere: Errs) -> Errs:
        """What it errs by here if an rms `level` is no gap elsewhere: more noise, by the same factor, or as much torque beside
        the noise; the lesser.
        """
        larger = self.noise * level / elsewhere.noise if elsewhere.noise > 0.0 else np.inf
        beside = float(np.sqrt(self.noise**2 + max(level**2 - elsewhere.noise**2, 0.0)))
        return Errs(min(larger, beside))


@dataclass(frozen=True)
class GapFound:
    """p-value of "no gap on either motion", and on which of the two there is one."""

    p_value: float
    on_unseen: bool
    on_fitted_only: bool

    @property
    def significant(self) -> bool:
        """On either."""
        return self.on_unseen or self.on_fitted_only


def gap_of(
    unseen: Sequence[Prediction],
    fitted: Sequence[Prediction],
    axis: str,
    cutoff_hz: float,
    unseen_errs: Errs,
    fitted_errs: Errs,
) -> GapFound:
    """Whether an axis has a gap on the motion that was not fitted, or at least on that which was.

    A cause that dies out, as a cold machine's friction does, may show on the fitted motion alone. What the unseen motion shows
    is no gap then, but what the comparison errs by: the fitted motion must exceed that too, each beyond its own noise. Two
    looks: the lesser p-value counts twice (Bonferroni).
    """
    level = gap_rms(unseen, axis)
    alike = fitted_errs.with_as_much(level, unseen_errs)
    beyond = max(fitted_errs, alike, key=lambda errs: errs.allowed)
    p_unseen = min(1.0, 2.0 * significance(unseen, axis, unseen_errs, cutoff_hz))
    p_fitted = min(1.0, 2.0 * significance(fitted, axis, beyond, cutoff_hz))
    on_unseen = p_unseen < SIGNIFICANT and level > unseen_errs.rms
    on_fitted = p_fitted < SIGNIFICANT and gap_rms(fitted, axis) > max(alike.rms, fitted_errs.rms)
    return GapFound(min(p_unseen, p_fitted), on_unseen, on_fitted and not on_unseen)


def significance(predictions: Sequence[Prediction], axis: str, errs: Errs, cutoff_hz: float) -> float:
    """p-value of "the gap of this axis is no more than noise and misfit"; small means that there is a gap.

    Under that, the gap is normal noise of at most a level through the filter: its mean square over a time T has 2 B T degrees
    of freedom, B the noise bandwidth of the filter at the cut-off that the recording can have (Rice 1944): chi-square,
    one-sided. The noise is taken 25 % larger than told, for that is as well as it is known, and with the misfit, which is what
    it is said to be, at least 0.2 % of the torque's rms. The gap's own unevenness is no doubt about it: a few large blocks
    among small ones are a gap.

    1.0 where nothing is in motion.
    """
    found = [each.axes[axis] for each in predictions]
    squares = np.concatenate([(each.measured - each.before)[each.used] ** 2 for each in found])
    torques = np.concatenate([each.measured[each.used] for each in found])
    degrees = sum(
        2.0 * BANDWIDTH * effective_cutoff(run.period, cutoff_hz) * float(each.used.sum()) * run.period
        for each, run in zip(found, predictions, strict=True)
    )
    if degrees < 2.0:
        return 1.0
    level = max(errs.allowed, SMALLEST_SHARE_OF_TORQUE * float(np.sqrt(np.mean(torques**2))))
    if level == 0.0:
        return 0.0 if squares.any() else 1.0
    return float(stats.chi2.sf(degrees * float(squares.mean()) / level**2, degrees))
