"""A position that reaches the drive late: filtering in the encoder, a serial interface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects.base import TIME, Exciting, Look, Need, Parameter, PartEffect, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class Delay(PartEffect):
    """Reading(t) = position(t - delay), for the loops and what the drive reports; straight lines between servo periods."""

    name: ClassVar[str] = "delay"
    family: ClassVar[str] = "sensing and timing"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION, Need.TWO_SPEEDS})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES, Exciting.SWEEP})
    by_motion: ClassVar[str] = "the same moves with higher accelerations and jerks"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LAG})
    rings: ClassVar[bool] = True
    like_errors: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("delay", TIME, low=0.0, high=0.05),)

    delay: float

    def on(self, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, encoder=replace(axis.encoder, delay=self.delay))

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [cls._start(delay) for delay in (0.001, 0.003, 0.01)]

    @classmethod
    def drawn(cls, ground: Ground) -> Delay:
        return cls(ground.draw.uniform(0.45, 0.65) / ground.bandwidth)

    @classmethod
    def _start(cls, delay: float) -> Start:
        return Start((cls(delay),), lambda found: cls(min(delay * found[0], 0.05)) if found[0] > 0.0 else None)
