"""One driven axis beyond its MuJoCo model: a record for each part that torque and motion pass through."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.encoder import Encoder
from drivetwin.emulator.dynamics.friction import FrictionLaw
from drivetwin.emulator.dynamics.joint import Joint
from drivetwin.emulator.dynamics.load import Load
from drivetwin.emulator.dynamics.motion import Motion
from drivetwin.emulator.dynamics.motor import Motor, Ripple
from drivetwin.emulator.dynamics.resistance import Resisting
from drivetwin.emulator.dynamics.transmission import Transmission
from drivetwin.foundation.cached import cached_property


@dataclass(frozen=True)
class AxisDynamics:
    """Parts of an axis in the order in which torque passes them; joint side, SI.

    `gear_ratio`: motor turns a joint turn, or rad/m; `slide`: the joint is prismatic.
    """

    gear_ratio: float = 1.0
    slide: bool = False
    motor: Motor = field(default_factory=Motor)
    ripples: tuple[Ripple, ...] = ()
    transmission: Transmission = field(default_factory=Transmission)
    friction: FrictionLaw = field(default_factory=FrictionLaw)
    load: Load = field(default_factory=Load)
    joint: Joint = field(default_factory=Joint)
    resisting: tuple[Resisting, ...] = ()
    encoder: Encoder = field(default_factory=Encoder)

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        """A search asks for it at every look into what it remembers."""
        return hash(tuple(getattr(self, part.name) for part in fields(self)))

    @cached_property
    def mechanics(self) -> AxisDynamics:
        """The axis between its motor's shaft and its load: what is replayed, whatever motor and encoder make of it."""
        return replace(self, motor=Motor(), ripples=(), encoder=Encoder())

    @property
    def strays(self) -> bool:
        """Whether its joint may move otherwise than its encoder reads."""
        return self.transmission.acts or self.encoder.acts

    @property
    def has_waves(self) -> bool:
        """Whether something passes on its way that may be faster than a recording."""
        amplitudes = self.encoder.eccentricity, self.transmission.error_amplitude, self.friction.position_amplitude
        return bool(self.ripples) or any(amplitudes)

    @cached_property
    def behind_the_spring(self) -> AxisDynamics:
        """The axis with that share of its friction that does not act on the motor."""
        return replace(self, friction=self.friction.scaled(1.0 - self.transmission.motor_friction_share))

    def by_current(self, shaft: NDArray[np.float64], motion: Motion) -> NDArray[np.float64]:
        """What the current must give (n,) of a torque of the shaft (n,), on the way of the joint: ripples give the rest."""
        if not self.ripples:
            return shaft
        return shaft - sum((ripple.on(motion, self.gear_ratio) for ripple in self.ripples), np.zeros_like(shaft))
