"""Friction that grows with the torque that gears and bearings transmit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw, Motion
from drivetwin.emulator.dynamics.friction import MOST_OF_LOAD
from drivetwin.emulator.effects.base import NUMBER, Exciting, FrictionEffect, Look, Need, Parameter, Start
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class LoadFriction(FrictionEffect):
    """Level of friction + coefficient |motor torque|: what the shaft gives, on the joint side, stands for what is transmitted.

    At a steady speed an axis that lifts a load L asks (L + friction) / (1 - coefficient). Linear in the load as in Bittencourt
    and Gunnarsson, ASME J. Dyn. Sys. Meas. Control 134(5), 2012.
    """

    name: ClassVar[str] = "load_friction"
    family: ClassVar[str] = "friction"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.ACCELERATION})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SPEED_LEVELS, Exciting.SHORT_MOVES})
    by_motion: ClassVar[str] = "the same strokes with and without a payload"
    by_sensor: ClassVar[str] = "a torque sensor on the joint"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LEVEL})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("coefficient", NUMBER, low=0.0, high=MOST_OF_LOAD),)

    coefficient: float

    def change(self, law: FrictionLaw) -> FrictionLaw:
        return replace(law, load_coefficient=self.coefficient)

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        return [Start((cls(0.1),), lambda found: cls(min(0.1 * found[0], MOST_OF_LOAD)) if found[0] > 0.0 else None)]

    @classmethod
    def drawn(cls, ground: Ground) -> LoadFriction:
        return cls(ground.share())
