"""Slow strokes: at low speed a lubricant film fails, and friction rises."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, back_and_forth
from drivetwin.emulator.effects import Exciting

SHARES = tuple(float(share) for share in np.geomspace(0.005, 0.3, 8))
"""Of full speed."""
SECONDS = 2.0
"""Of each stroke, where the travel is long enough."""


class SlowStrokes(Excitation):
    """Back and forth at speeds down to a two-hundredth of the highest, at places all over the travel."""

    name = Exciting.SLOW_STROKES
    purpose = "friction that falls as the speed grows shows below a tenth of the top speed, and nowhere else"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        for number, share in enumerate(SHARES):
            way = min(limits.room, SECONDS * share * limits.most.speed)
            low = limits.travel[0] + (number / (len(SHARES) - 1)) * (limits.room - way)
            yield back_and_forth(low, low + way, limits.slower(share), period)
