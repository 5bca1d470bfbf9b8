"""What effects between motor and joint have in common: the axis is replayed with another transmission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.effects.base import JOINT_ENCODER, PartEffect

SIDES = (0.0, 0.3, 0.8)
"""Shares of the friction on the motor's side, with which a search begins; none stays none."""


@dataclass(frozen=True)
class TransmissionEffect(PartEffect):
    """An effect of the transmission alone."""

    family: ClassVar[str] = "transmission"
    by_sensor: ClassVar[str] = JOINT_ENCODER
    like_errors: ClassVar[bool] = True
