"""Friction that varies along the way: a bent screw, a gear's teeth, a dry spot each turn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from emulator.dynamics import FrictionLaw
from emulator.effects.base import ANGLE, POSITION, TORQUE, FrictionEffect, Parameter


@dataclass(frozen=True)
class PositionFriction(FrictionEffect):
    """Level of friction + amplitude sin(2 pi q / period + phase), q the joint's position; at most the law's `coulomb`.

    One line of the spectrum of Popovic and Goldenberg, IEEE Trans. Robotics and Automation 14(1), 1998.
    """

    name: ClassVar[str] = "position_friction"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("amplitude", TORQUE, low=0.0),
        Parameter("period", POSITION, low=1e-6),
        Parameter("phase", ANGLE),
    )

    amplitude: float
    period: float
    phase: float = 0.0

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(
            law, position_amplitude=self.amplitude, position_period=self.period, position_phase=self.phase
        )
