"""One period of the torque that excites an axis: a multisine, so that each line is a frequency and leaks into no other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.recording.recording import Samples

Lines = NDArray[np.int64]

HIGHEST = 0.2
"""Highest line as a share of the sample rate. A torque that is held for a cycle has images about the sample rate; an axis that
follows it as 1/f² brings the image of this line into it at 1 % (0.1 dB), and at a quarter at 4 %."""

DRAWS = 40
"""Draws of random phases, of which the one with the lowest peak is taken."""


@dataclass(frozen=True)
class Wave:
    """A period (n,) [N·m or N], and its lines (m,) as whole numbers of periods in it."""

    samples: Samples
    lines: Lines


def lines_in(length: int, count: int) -> Lines:
    """About `count` lines (m,), evenly spaced on a logarithmic axis from one period in `length` samples up to `HIGHEST`."""
    return np.unique(np.rint(np.geomspace(1.0, max(1.0, HIGHEST * length), count)).astype(np.int64))


def multisine(length: int, lines: Lines, sizes: Samples, seed: int) -> Wave:
    """A period of `length` samples with amplitudes `sizes` (m,) at its lines.

    Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2012, 5.3.
    """
    angle = 2.0 * np.pi * np.outer(np.arange(length) / length, lines)
    random = np.random.default_rng(seed)
    best, lowest = np.zeros(length), np.inf
    for _ in range(DRAWS):
        wave = np.cos(angle + random.uniform(0.0, 2.0 * np.pi, len(lines))) @ sizes
        if (peak := float(np.abs(wave).max())) < lowest:
            best, lowest = wave, peak
    return Wave(np.asarray(best), lines)
