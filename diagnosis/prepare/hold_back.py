"""Which motion is fitted and which is not, where nobody gave recordings to validate on: blocks spread over each recording.

What is held back has to be like the whole: the end of a sweep is small and fast, and tells mostly of friction that yields.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.run import Run
from drivetwin.motion.filtering import reach

Mask = NDArray[np.bool_]

QUARTERS = (2, 0, 3, 1)
"""Of a stretch of the recording, the quarter that is held back, stretch by stretch: in the order of van der Corput (1935), so
that of motion that repeats every phase is held back."""
LONG, REACHES = 0.5, 4
"""Of several blocks of a recording [s]; the least of a single one, in reaches of the filter."""
BLOCKS = (8, 4, 2)
"""Of a recording, as many as are long."""
MANY = 4
"""Recordings that are too short for a block, of which one in so many is held back whole."""
FAIR = 0.1
"""Of the samples of an axis that count, as many are in either part."""

Split = tuple[list[Run], list[Run]]
"""What is fitted, and what is not."""


def hold_back(runs: Sequence[Run]) -> Split:
    """A quarter of each recording, in blocks; of those that are too short for one, every fourth by speed.

    It is the quarter that has most nearly a quarter of each recording's gap, by its energy, of those by which every axis moves
    in both parts; else the one by which the axis that moves least in one of them moves most there.
    """
    turns = [_held(runs, turn) for turn in range(len(QUARTERS))]
    able = [each for each in turns if _fair(runs, each) >= FAIR] or [max(turns, key=lambda each: _fair(runs, each))]
    held = min(able, key=lambda each: _unlike(runs, each))
    pairs = list(zip(runs, held, strict=True))
    return [run.without(part) for run, part in pairs if not part.all()], [run.only(part) for run, part in pairs if part.any()]


def _held(runs: Sequence[Run], turn: int) -> list[Mask]:
    """Samples (n,) of each recording that are held back, each block so many quarters further on."""
    held = [_blocks(run, turn) for run in runs]
    short = sorted((run for run, part in zip(runs, held, strict=True) if not part.any()), key=_speed)
    whole = short[(MANY // 2 + turn) % MANY : -1 : MANY] if len(short) >= MANY else []
    return [np.ones_like(part) if any(run is other for other in whole) else part for run, part in zip(runs, held, strict=True)]


def _blocks(run: Run, turn: int) -> Mask:
    count = len(run.recording.time)
    held = np.zeros(count, dtype=np.bool_)
    least = len(QUARTERS) * REACHES * reach(run.period, run.cutoff_hz)
    long = max(least, len(QUARTERS) * LONG / run.period)
    stretches = next((number for number in BLOCKS if count >= number * long), int(count >= least))
    quarter = count / max(len(QUARTERS) * stretches, 1)
    for number in range(stretches):
        first = len(QUARTERS) * number + (QUARTERS[number % len(QUARTERS)] + turn) % len(QUARTERS)
        held[round(first * quarter) : round((first + 1) * quarter)] = True
    return held


def _fair(runs: Sequence[Run], held: Sequence[Mask]) -> float:
    """Of the axis of which least is in one of the parts, the share of its samples there; 0 without any held back."""
    shares = []
    for axis in runs[0].axes:
        counts = sum(int(run.axes[axis].used.sum()) for run in runs)
        there = sum(int((run.axes[axis].used & part).sum()) for run, part in zip(runs, held, strict=True))
        if counts:
            shares.append(min(there, counts - there) / counts)
    return min(shares, default=0.0)


def _unlike(runs: Sequence[Run], held: Sequence[Mask]) -> float:
    """How far the gaps' energy that is held back is from a quarter of each recording's, as a share of an axis's whole: of all
    axes together, in hundredths. Recordings that are held back or fitted whole count as one.
    """
    away = 0.0
    for axis in runs[0].axes:
        gaps = [np.where(own.used, own.torque - own.base, 0.0) ** 2 for own in (run.axes[axis] for run in runs)]
        there = np.array([float(gap[part].sum()) for gap, part in zip(gaps, held, strict=True)])
        whole = np.array([float(gap.sum()) for gap in gaps])
        off, split = there - whole / len(QUARTERS), np.array([bool(part.any() and not part.all()) for part in held])
        away += float(np.abs(off[split]).sum() + abs(off[~split].sum())) / max(float(whole.sum()), 1e-300)
    return round(away, 2)


def _speed(run: Run) -> float:
    """Mean speed of its fastest axis, in the axis's own unit."""
    return float(np.max(np.mean(np.abs(run.kinematics.velocity), axis=0)))
