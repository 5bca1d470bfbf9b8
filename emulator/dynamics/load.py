"""A torque on a joint that depends on its position alone: a weight that the model lacks."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from drivetwin.foundation.compiled import in_place


@dataclass(frozen=True)
class Load:
    """Torque on the joint = -(sine sin q + cosine cos q + constant) [N·m or N]."""

    sine: float = 0.0
    cosine: float = 0.0
    constant: float = 0.0

    @property
    def acts(self) -> bool:
        """Whether there is any."""
        return any((self.sine, self.cosine, self.constant))

    def resistance(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Torque (n,) that holds it at joint positions (n,)."""
        return np.asarray(self.sine * np.sin(position) + self.cosine * np.cos(position) + self.constant)

    def slope(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Its derivative (n,) by the position [N·m/rad or N/m]."""
        return np.asarray(self.sine * np.cos(position) - self.cosine * np.sin(position))


@in_place
def apply_loads(loads, position, applied) -> None:  # type: ignore[no-untyped-def]  # record arrays have no static type
    """Add loads to what acts on the joints in the coming step."""
    for row in range(loads.shape[0]):
        load = loads[row]
        q = position[load.qpos]
        applied[load.dof] -= load.sine * sin(q) + load.cosine * cos(q) + load.constant
