"""The window in which a gap is compared, by the contract of the gap report: in motion, both torques through one low-pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]

USUAL = 48.0
"""No band is narrower [Hz], where the sample rate bears it."""
OF_RATE = 0.4
"""Of the sample rate, that a band is at most."""
TELLS = 0.05
"""Share of the power with which a torque varies, that may lie above its band."""
STEP = 2.0**0.25
"""From one band to the next that is tried."""


@dataclass(frozen=True)
class Window:
    """A low-pass of no delay at `band` [Hz], of values taken every `tick` [s]; `moving` (k, n) are the samples that count.

    Values that are taken too seldom for the band hold less of it.
    """

    band: float
    tick: float
    moving: NDArray[np.bool_]

    def of(self, values: Array, axis: int) -> Array:
        """What is compared (m,) of a torque (k,) of an axis. At standstill it is anything: nothing of that comes through."""
        moving = self.moving[:, axis]
        return np.asarray(_low_pass(np.where(moving, values, 0.0), self.tick, self._held)[moving])

    @property
    def _held(self) -> float:
        return min(self.band, OF_RATE / self.tick)


def band_of(torques: Sequence[Array], tick: float, rate: float) -> float:
    """The lowest band [Hz] above which no torque (k,), taken every `tick` [s] and recorded at `rate` [Hz], varies much."""
    highest = OF_RATE * rate
    band = min(USUAL, highest)
    while band < highest and any(_above(torque, tick, band) > TELLS for torque in torques):
        band = min(STEP * band, highest)
    return band


def of_white_noise(band: float, rate: float) -> float:
    """What a low-pass at `band` [Hz] leaves of the rms of white noise that is recorded at `rate` [Hz]."""
    impulse = np.zeros(2 * max(64, round(8.0 * rate / band)) + 1)
    impulse[len(impulse) // 2] = 1.0
    return float(np.linalg.norm(_low_pass(impulse, 1.0 / rate, band)))


def _above(torque: Array, tick: float, band: float) -> float:
    power = np.abs(np.fft.rfft(signal.detrend(torque))) ** 2
    return float(power[np.fft.rfftfreq(len(torque), tick) > band].sum() / max(power.sum(), 1e-300))


def _low_pass(values: Array, tick: float, band: float) -> Array:
    sections = signal.butter(4, band, fs=1.0 / tick, output="sos")
    return np.asarray(signal.sosfiltfilt(sections, values))
