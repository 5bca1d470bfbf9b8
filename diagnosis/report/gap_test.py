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
    noise_rms: float,
    cutoff_hz: float,
    misfit: float = 0.0,
) -> GapFound:
    """Whether an axis has a gap on the motion that was not fitted, or at least on that which was.

    A cause that dies out, as a cold machine's friction does, may show on the fitted motion alone. What the unseen motion shows
    is no gap then, but what the comparison errs by: the fitted motion must exceed that too. Two looks: the lesser p-value
    counts twice (Bonferroni). `noise_rms` and `misfit` as of `significance`.
    """
    level, least = gap_rms(unseen, axis), float(np.hypot(noise_rms, misfit))
    beyond = (noise_rms, misfit) if _allowed(level, 0.0) < _allowed(noise_rms, misfit) else (level, 0.0)
    p_unseen = min(1.0, 2.0 * significance(unseen, axis, noise_rms, cutoff_hz, misfit))
    p_fitted = min(1.0, 2.0 * significance(fitted, axis, beyond[0], cutoff_hz, beyond[1]))
    on_unseen = p_unseen < SIGNIFICANT and level > least
    on_fitted = p_fitted < SIGNIFICANT and gap_rms(fitted, axis) > max(level, least)
    return GapFound(min(p_unseen, p_fitted), on_unseen, on_fitted and not on_unseen)


def significance(
    predictions: Sequence[Prediction], axis: str, noise_rms: float, cutoff_hz: float, misfit: float = 0.0
) -> float:
    """p-value of "the gap of this axis is no more than noise and misfit"; small means that there is a gap.

    Under that, the gap is normal noise of at most `noise_rms` [N·m or N] through the filter: its mean square over a time T has
    2 B T degrees of freedom, B the noise bandwidth of the filter at the cut-off that the recording can have (Rice 1944):
    chi-square, one-sided. The noise is taken 25 % larger than told, for that is as well as it is known, and with `misfit`
    [N·m or N], which is what it is said to be, at least 0.2 % of the torque's rms. The gap's own unevenness is no doubt about
    it: a few large blocks among small ones are a gap.

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
    level = max(_allowed(noise_rms, misfit), SMALLEST_SHARE_OF_TORQUE * float(np.sqrt(np.mean(torques**2))))
    if level == 0.0:
        return 0.0 if squares.any() else 1.0
    return float(stats.chi2.sf(degrees * float(squares.mean()) / level**2, degrees))


def _allowed(noise_rms: float, misfit: float) -> float:
    """What is no gap [N·m or N]: noise as large as it may be, and the misfit."""
    return float(np.hypot((1.0 + NOISE_KNOWN_TO) * noise_rms, misfit))
