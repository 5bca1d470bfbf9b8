"""Is a gap more than noise: a test that knows how little a long, correlated residual says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from diagnosis.result import Array, Prediction

NAME = "one-sided t-test of the gap's mean square in blocks against the noise's"

NOISE_KNOWN_TO = 0.1
"""Relative error of a noise level that is told from a few standstills or repetitions; the test allows for it."""
SMALLEST_SHARE_OF_TORQUE = 0.002
"""Of the torque's rms: a gap below is no machine's but arithmetic's, a filter's or a rounding's."""
PERIODS_OF_CUTOFF = 20.0
"""A block's length in periods of the cut-off: noise through that filter is forgotten after one."""
FEWEST_BLOCKS = 8


def significance(predictions: Sequence[Prediction], axis: str, noise_rms: float, cutoff_hz: float) -> float:
    """p-value of "the gap of this axis is no more than noise"; small means that there is a gap.

    The gap's samples in motion are cut into blocks of 20 periods of the cut-off (shorter ones where that makes fewer than
    eight), and the blocks' mean squares are put to Student's one-sided t-test against the square of the noise, taken 10 %
    larger than `noise_rms` [N·m or N], for that is as well as it is known, and at least 0.2 % of the torque's rms.

    Assumed: the noise's correlation is short beside a block, so that blocks are nearly independent, and its level is the same
    everywhere. Mean squares are skewed to the right, which makes the upper tail of t the safe one. 1.0 where fewer than two
    blocks are in motion: nothing is shown. Source: Student 1908; blocks as in Carlstein, Annals of Statistics 14(3), 1986.
    """
    found = [each.axes[axis] for each in predictions]
    squares = [(each.measured - each.before)[each.used] ** 2 for each in found]
    torques = np.concatenate([each.measured[each.used] for each in found])
    seconds = sum(len(each) * run.period for each, run in zip(squares, predictions, strict=True))
    block = min(PERIODS_OF_CUTOFF / cutoff_hz, seconds / FEWEST_BLOCKS)
    means = np.concatenate([_block_means(each, block, run.period) for each, run in zip(squares, predictions, strict=True)])
    if len(means) < 2:
        return 1.0
    torque_rms = float(np.sqrt(np.mean(torques**2)))
    level = max((1.0 + NOISE_KNOWN_TO) * noise_rms, SMALLEST_SHARE_OF_TORQUE * torque_rms)
    return _p_value(means, level**2)


def _block_means(samples: Array, block: float, period: float) -> Array:
    """Means of the whole blocks of `block` [s] in `samples` (n,) that stand every `period` [s]."""
    length = max(1, int(block / period + 1e-6))
    count = len(samples) // length
    return np.asarray(samples[: count * length].reshape(count, length).mean(axis=1), dtype=np.float64)


def _p_value(means: Array, expected: float) -> float:
    """Of a mean above `expected`; 0 or 1 where the blocks are all the same."""
    excess = float(means.mean()) - expected
    error = float(means.std(ddof=1)) / np.sqrt(len(means))
    if error == 0.0:
        return 0.0 if excess > 0.0 else 1.0
    return float(stats.t.sf(excess / error, len(means) - 1))
