"""Strokes at several speeds up to the highest: what friction does with speed, in both directions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, back_and_forth
from drivetwin.emulator.effects import Exciting

SHARES = tuple(float(share) for share in np.linspace(0.1, 1.0, 8))
"""Of full speed."""
SECONDS = 3.0
"""Of each stroke, where the travel is long enough."""


class SpeedLevels(Excitation):
    """Back and forth about the middle of the travel at eight speeds."""

    name = Exciting.SPEED_LEVELS
    purpose = "a straight line over speed is viscous, a bent one is not, and one that differs with the direction is asymmetric"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        for share in SHARES:
            half = 0.5 * min(limits.room, SECONDS * share * limits.most.speed)
            yield back_and_forth(limits.at(0.5) - half, limits.at(0.5) + half, limits.slower(share), period)
