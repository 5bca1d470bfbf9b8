"""Which motion is fitted and which is not, where nobody gave recordings to validate on: blocks spread over each recording.

What is held back has to be like the whole: the end of a sweep is small and fast, and tells mostly of friction that yields.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.motion import Run
from drivetwin.motion.filtering import reach

Mask = NDArray[np.bool_]

QUARTERS = (2, 0, 3, 1)
"""Of a stretch of the recording, the quarter that is held back, stretch by stretch: in the order of van der Corput (1935), so
that of motion that repeats every phase is held back."""
SHORTEST, REACHES = 0.5, 4
"""Of a block [s], and in reaches of the filter."""
BLOCKS = (8, 4, 2, 1)
"""Of a recording, as many as are long enough."""
MANY = 4
"""Recordings that are too short for a block, of which one in so many is held back whole."""
MOVES = 0.1
"""Of the longest way of an axis, that it must go in a part of the recordings to move there."""

Split = tuple[list[Run], list[Run]]
"""What is fitted, and what is not."""


def hold_back(runs: Sequence[Run]) -> Split:
    """A quarter of each recording, in blocks; a recording that is too short for one is fitted whole.

    Where all are, every fourth by speed is held back, if every axis then moves in both parts.
    """
    blocks = [_blocks(run) for run in runs]
    if any(held.any() for held in blocks):
        pairs = list(zip(runs, blocks, strict=True))
        return [run.without(held) for run, held in pairs], [run.only(held) for run, held in pairs if held.any()]
    whole = _whole(runs)
    return whole if all(_moves_as_in(part, runs) for part in whole) else (list(runs), [])


def _blocks(run: Run) -> Mask:
    """Samples (n,) that are held back."""
    count = len(run.recording.time)
    held = np.zeros(count, dtype=np.bool_)
    shortest = max(REACHES * reach(run.period, run.cutoff_hz), round(SHORTEST / run.period))
    stretches = next((number for number in BLOCKS if count >= number * len(QUARTERS) * shortest), 0)
    quarter = count / max(len(QUARTERS) * stretches, 1)
    for number in range(stretches):
        first = len(QUARTERS) * number + QUARTERS[number % len(QUARTERS)]
        held[round(first * quarter) : round((first + 1) * quarter)] = True
    return held


def _whole(runs: Sequence[Run]) -> Split:
    """The slowest and the fastest are always fitted: what happens there is not to be told from the others."""
    by_speed = sorted(runs, key=_speed)
    held = by_speed[MANY // 2 : -1 : MANY]
    return [one for one in runs if all(one is not other for other in held)], held


def _moves_as_in(part: Sequence[Run], runs: Sequence[Run]) -> bool:
    """Whether every axis that moves in the recordings moves in a part of them, too: one that only holds its place trembles."""
    whole, own = _travels(runs), _travels(part)
    return bool(np.all(own >= MOVES * whole))


def _travels(runs: Sequence[Run]) -> NDArray[np.float64]:
    """The longest way of each axis in one recording (k,) [rad or m]; 0 without any."""
    return np.max([np.ptp(run.kinematics.position, axis=0) for run in runs], axis=0) if runs else np.zeros(1)


def _speed(run: Run) -> float:
    """Mean speed of its fastest axis, in the axis's own unit."""
    return float(np.max(np.mean(np.abs(run.kinematics.velocity), axis=0)))
