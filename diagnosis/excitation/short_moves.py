"""Short moves of several accelerations in one range of speed: inertia apart from what goes with speed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, back_and_forth
from drivetwin.emulator.effects import Exciting

ACCELERATIONS = (0.25, 0.5, 0.75, 1.0)
"""Shares of the highest; the last asks for all the torque that the limits allow."""
SPEED = 0.4
"""Of full speed at most."""
PLACES = (0.25, 0.5, 0.75)
WAY = 0.2
"""Of the travel."""


class ShortMoves(Excitation):
    """Back and forth by a fifth of the travel at four accelerations and three places."""

    name = Exciting.SHORT_MOVES
    purpose = "torque that goes with acceleration at the same speeds is inertia; torque that ends at a level is saturation"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        half = 0.5 * WAY
        for place in PLACES:
            for share in ACCELERATIONS:
                most = replace(limits.slower(SPEED), acceleration=share * limits.most.acceleration)
                yield back_and_forth(limits.at(place - half), limits.at(place + half), most, period)
