"""Samples read between samples: what was recorded late, as it was when it happened."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

Array = NDArray[np.float64]

REACH = 24
"""Samples before and after, of which a value between two samples is made."""


def earlier(samples: Array, late: float, period: float) -> Array:
    """Samples (n,), taken every `period` [s], as they were `late` [s] after each; band-limited interpolation.

    Sinc under a Kaiser window (Laakso et al., IEEE Signal Processing Magazine 13(1), 1996, sec. 3), which passes all
    frequencies up to 0.9 of half the sample rate alike. A spline damps noise there, and noise would decide how late a torque
    is; straight lines take up to half the energy of what passes at a quarter of the rate.
    """
    whole = round(late / period)
    shifted = ndimage.shift(samples, -whole, order=0, mode="nearest") if whole else samples
    part = late / period - whole
    if part == 0.0:
        return np.asarray(shifted, dtype=np.float64)
    at = np.arange(-REACH, REACH + 1, dtype=np.float64)
    kernel = np.sinc(at - part) * _kaiser((at - part) / (REACH + 0.5))
    return np.asarray(ndimage.correlate1d(shifted, kernel / kernel.sum(), mode="nearest"))


def _kaiser(share: Array) -> Array:
    """The window at shares of its half-width, |share| <= 1; beta 6."""
    return np.asarray(special.i0(6.0 * np.sqrt(1.0 - share**2)) / special.i0(6.0))
