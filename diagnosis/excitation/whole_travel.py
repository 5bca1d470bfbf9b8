"""Slow strokes over the whole travel, twice from different starts: what a torque does with the place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, back_and_forth
from drivetwin.emulator.effects import Exciting

SECONDS = (10.0, 6.0)
"""Of a stroke, the first time and the second."""


class WholeTravel(Excitation):
    """The whole travel and back at one slow speed, then nearly all of it at another: what stays in place is of the place."""

    name = Exciting.WHOLE_TRAVEL
    purpose = "a straight line over the place is a spring, a sine of the angle a weight, a short wave the motor or the gear"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        for seconds, (low, high) in zip(SECONDS, ((0.0, 1.0), (0.97, 0.02)), strict=True):
            speed = min(limits.most.speed, limits.room / seconds)
            yield back_and_forth(limits.at(low), limits.at(high), replace(limits.most, speed=speed), period)
