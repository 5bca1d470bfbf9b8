"""Friction that grows with the torque that gears and bearings transmit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from emulator.dynamics import FrictionLaw
from emulator.effects.base import NUMBER, FrictionEffect, Parameter


@dataclass(frozen=True)
class LoadFriction(FrictionEffect):
    """Level of friction + coefficient |motor torque|: what the shaft gives, on the joint side, stands for what is transmitted.

    At a steady speed an axis that lifts a load L asks (L + friction) / (1 - coefficient). Linear in the load as in Bittencourt
    and Gunnarsson, ASME J. Dyn. Sys. Meas. Control 134(5), 2012.
    """

    name: ClassVar[str] = "load_friction"
    family: ClassVar[str] = "friction"
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("coefficient", NUMBER, low=0.0, high=0.9),)

    coefficient: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, load_coefficient=self.coefficient)
