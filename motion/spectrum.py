"""The power density of a sampled position or velocity, over which no trend leaks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]


def density(samples: Array, period: float, times: int, length: int) -> tuple[Array, Array]:
    """Frequencies [Hz] above 0 and the one-sided density there, (k,) each: Welch (1967) on differences, their gain taken out.

    `times`: how often `samples` (n,), `period` [s] apart, are differenced. `length`: samples of a segment, at most n - `times`.
    """
    frequency, power = signal.welch(np.diff(samples, times), fs=1.0 / period, nperseg=length, detrend=False)
    at = frequency[1:]
    return at, power[1:] / (2.0 * np.sin(np.pi * at * period)) ** (2 * times)
