"""Effects between the torque that a drive reports and the one that its motor's shaft gives: each bends what the others cost."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.emulator.effects.base import PartEffect, StaticEffect


@dataclass(frozen=True)
class MotorEffect(PartEffect, StaticEffect):
    """A change of the motor: it costs what the drive then reports more for the same motion."""
