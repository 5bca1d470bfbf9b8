"""Small slow reversals: what gives way before it slides, and what turns back before the load does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, wave, window
from drivetwin.emulator.effects import Exciting

PLACES = (0.2, 0.5, 0.8)
SIZES = (0.0005, 0.004, 0.02)
"""Amplitudes, as shares of the travel."""
FREQUENCY, SECONDS = 0.8, 8.0


class SmallReversals(Excitation):
    """Swings that grow and shrink, of three sizes at three places."""

    name = Exciting.SMALL_REVERSALS
    purpose = "bristles make a loop that grows with the distance, backlash a step of one width, friction neither"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        count = round(SECONDS / period)
        swing = window(count) * np.sin(2.0 * np.pi * FREQUENCY * np.arange(1, count + 1) * period)
        for place in PLACES:
            for size in SIZES:
                yield wave(limits.at(place), swing, size * limits.room, limits.most, period)
