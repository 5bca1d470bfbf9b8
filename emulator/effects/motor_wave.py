"""What waves of the motor's angle have in common: their order, a whole number where slots, poles and teeth make it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import log, pi
from typing import ClassVar, Self

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import AxisEffect, Exciting, Look, Need
from drivetwin.emulator.effects.waves import FRACTIONAL, turns_apart


@dataclass(frozen=True)
class MotorWave(AxisEffect):
    """amplitude sin(order * motor angle + phase); `order` is in waves a motor turn."""

    needs: ClassVar[frozenset[Need]] = frozenset({Need.MOTOR_ANGLE})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.WHOLE_TRAVEL})
    looks: ClassVar[frozenset[Look]] = frozenset({Look.WAVE})

    amplitude: float
    order: float
    phase: float = 0.0

    def natural(self, axis: AxisDynamics) -> Self | None:
        """Slots, poles and teeth come in whole numbers a turn."""
        whole = max(1.0, float(round(self.order)))
        return replace(self, order=whole) if whole != self.order else None

    def repeats(self, axis: AxisDynamics) -> float:
        return 2.0 * pi / (axis.gear_ratio * self.order)

    def fixed(self, axis: AxisDynamics) -> frozenset[str]:
        return frozenset({"order"}) if self.order == round(self.order) else frozenset()

    def unlikely(self, motion: Motion, axis: AxisDynamics) -> float:
        """An order that is no whole number needs a gear ratio that is not the recording's."""
        return 0.0 if self.order == round(self.order) else log(FRACTIONAL)

    def sizes(self, motion: Motion, axis: AxisDynamics) -> dict[str, float]:
        return super().sizes(motion, axis) | {"order": turns_apart(motion, axis), "phase": 1.0}
