"""A sweep of small sines: what resonates, what lags and what is late."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, wave, window
from drivetwin.emulator.effects import Exciting

BANDS = ((1.0, 4.0), (4.0, 12.0), (12.0, 40.0))
"""From and to [Hz], each a piece with an amplitude of its own."""
SECONDS = 6.0
FEWEST_A_WAVE = 5
"""Set-points: a controller's cycle cannot tell faster sines, whatever it makes between them."""
SIZE = 0.05
"""Amplitude at most, as a share of the travel."""


class Sweep(Excitation):
    """Sines whose frequency grows by the same factor in the same time, in three bands about the middle of the travel."""

    name = Exciting.SWEEP
    purpose = "a spring resonates at one frequency, a delay turns the phase in proportion to frequency, a lag levels off"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        count = round(SECONDS / period)
        time = np.arange(1, count + 1) * period
        highest = 1.0 / (FEWEST_A_WAVE * period)
        for low, high in ((low, min(high, highest)) for low, high in BANDS if low < highest):
            rate = np.log(high / low) / SECONDS
            chirp = window(count) * np.sin(2.0 * np.pi * low * np.expm1(rate * time) / rate)
            yield wave(limits.at(0.5), chirp, SIZE * limits.room, limits.most, period)
