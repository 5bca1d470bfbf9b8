"""What one driven axis is, beyond what its MuJoCo model says: a record for each part that torque and motion pass."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from emulator.dynamics.encoder import Encoder
from emulator.dynamics.friction import FrictionLaw
from emulator.dynamics.load import Load
from emulator.dynamics.motor import Motor
from emulator.dynamics.transmission import Transmission


@dataclass(frozen=True)
class AxisDynamics:
    """Parts of an axis in the order in which torque passes them; joint side, SI.

    `gear_ratio`: motor turns a joint turn, or rad/m; `slide`: the joint is prismatic.
    """

    gear_ratio: float = 1.0
    slide: bool = False
    motor: Motor = field(default_factory=Motor)
    transmission: Transmission = field(default_factory=Transmission)
    friction: FrictionLaw = field(default_factory=FrictionLaw)
    load: Load = field(default_factory=Load)
    encoder: Encoder = field(default_factory=Encoder)

    def is_nearly(self, other: AxisDynamics, share: float) -> bool:
        """Whether no number of the two differs by more than that share of it."""
        return bool(np.allclose(_numbers(self), _numbers(other), rtol=share, atol=0.0))


@lru_cache(maxsize=256)
def _numbers(axis: AxisDynamics) -> NDArray[np.float64]:
    """All parameters of an axis, (n,)."""
    parts = (axis.motor, axis.transmission, axis.friction, axis.load, axis.encoder)
    own = [axis.gear_ratio, float(axis.slide)]
    return np.array([*own, *(float(getattr(part, one.name)) for part in parts for one in fields(part))])
