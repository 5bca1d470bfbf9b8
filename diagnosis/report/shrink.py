"""How far a gap shrinks on motion that was not fitted, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.report.result import TWO_SIDED_90, Prediction, Shrink

Array = NDArray[np.float64]

BLOCK = 1.0
"""Of contiguous time that is drawn together [s]."""
DRAWS = 400
BETWEEN_MOTIONS = 0.35
"""Standard deviation of the logarithm of the share that is left, from one motion to another: measured (docs/diagnosis.md)."""


def shrink(
    before: Sequence[Prediction], with_it: Sequence[Prediction], axis: str, noise_rms: float, seed: int
) -> Shrink | None:
    """gap_closed = 1 - (rms after / before)²; `with_it` predicts in `after` what one more effect makes of `before`'s `after`.

    The interval is that of another recording of as many blocks, on the logarithm of the share that is left: blocks of a second
    are drawn anew (Carlstein 1986), twice over, once for what was seen and once for what will be, and BETWEEN_MOTIONS is added,
    for other motion has other regimes. Sums of blocks leave no more than the worst block and no less than the best: the
    interval ends BETWEEN_MOTIONS beyond these, for draws are not normal where one block holds nearly all. None where the axis
    never moves or has no gap.
    """
    asked = [_asked(each, later, axis) for each, later in zip(before, with_it, strict=True)]
    first, last = _block_sums(asked, axis), _block_sums(with_it, axis)
    if first.sum() <= 0.0 or len(first) < 2:
        return None
    count = sum(int(each.axes[axis].used.sum()) for each in before)
    noise = noise_rms**2 * count
    closed = 1.0 - last.sum() / first.sum()
    explainable = float(first.sum() - noise)
    of_explainable = 1.0 - max(float(last.sum()) - noise, 0.0) / explainable if explainable > 0.0 else None
    left = max(1.0 - closed, 1e-9)
    drawn = np.random.default_rng(seed).integers(len(first), size=(DRAWS, len(first)))
    shares = np.log(np.maximum(last[drawn].sum(axis=1) / np.maximum(first[drawn].sum(axis=1), 1e-300), 1e-9))
    deviation = float(np.hypot(np.sqrt(2.0) * np.std(shares), BETWEEN_MOTIONS))
    factor, between = np.exp(TWO_SIDED_90 * np.array([deviation, BETWEEN_MOTIONS]))
    each = last[first > 0.0] / first[first > 0.0]
    most, least = min(left * factor, each.max() * between), max(left / factor, each.min() / between)
    interval = (float(1.0 - max(most, left)), float(1.0 - min(least, left)))
    return Shrink(float(closed), interval, of_explainable)


def _asked(before: Prediction, with_it: Prediction, axis: str) -> Prediction:
    """What is predicted before one more effect; of a drive's, with what the drive withheld, for its law asked for that."""
    own, later = before.axes[axis], with_it.axes[axis]
    return replace(before, axes={axis: replace(own, after=own.after + later.before - own.before)})


def _block_sums(predictions: Sequence[Prediction], axis: str) -> Array:
    """Sums of squares over the samples in use of each block."""
    sums = []
    for each in predictions:
        part = each.axes[axis]
        squares = np.where(part.used, (part.measured - part.after) ** 2, 0.0)
        length = max(1, round(BLOCK / each.period))
        blocks = np.add.reduceat(squares, np.arange(0, len(squares), length))
        used = np.add.reduceat(part.used.astype(np.float64), np.arange(0, len(squares), length))
        sums.append(blocks[used > 0.0])
    return np.concatenate(sums) if sums else np.zeros(0)
