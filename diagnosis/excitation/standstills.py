"""Standstills approached from both sides, and creeping away from them: what holds, what pulls, and where it lets go."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import Path, move, stand
from drivetwin.emulator.effects import Exciting

PLACES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Shares of the travel."""
APPROACH = 0.05
"""Of the travel, from where a place is approached."""
CREEP_SPEED, CREEP_SECONDS = 0.002, 2.0
"""Share of full speed, and for how long: so slowly the drive finds the torque that just moves the axis."""
REST = 0.6
"""At a place [s]."""


class Standstills(Excitation):
    """At each place: come from below, rest, creep on, rest, creep back; then the same from above."""

    name = Exciting.STANDSTILLS
    purpose = "an offset shifts the torque that just moves the axis the same way in both directions, friction to either side"

    def pieces(self, limits: AxisLimits, period: float) -> Iterator[Path]:
        for share in PLACES:
            for side in (-1.0, 1.0):
                yield _approached(limits, limits.at(share), side, period)


def _approached(limits: AxisLimits, place: float, side: float, period: float) -> Path:
    creeping = limits.slower(CREEP_SPEED)
    aside = APPROACH * limits.room
    start, beyond = place + side * aside, place - side * min(aside, CREEP_SECONDS * creeping.speed)
    return np.concatenate(
        [
            stand(start, REST, period),
            move(start, place, limits.slower(0.2), period),
            stand(place, REST, period),
            move(place, beyond, creeping, period),
            stand(beyond, REST, period),
            move(beyond, place, creeping, period),
        ]
    )
