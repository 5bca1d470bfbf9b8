"""The same strokes from cold until warm: what changes with time alone."""

from __future__ import annotations

from collections.abc import Iterator

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, back_and_forth
from drivetwin.emulator.effects import Exciting

SECONDS = 90.0
SPEED = 0.6
"""Of full speed."""


class WarmUp(Excitation):
    """One stroke, again and again for a minute and a half; begin with a cold machine."""

    name = Exciting.WARM_UP
    purpose = "friction that falls from stroke to stroke is warmth: neither speed nor place changes"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        stroke = back_and_forth(*limits.travel, limits.slower(SPEED), period)
        for _ in range(max(2, round(SECONDS / (len(stroke) * period)))):
            yield stroke
