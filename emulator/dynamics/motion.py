"""A measured motion of one axis, as the effects whose torque follows from it need it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Motion:
    """Joint side, each (n,): rad, rad/s, rad/s², N·m (m, m/s, m/s², N); `time` [s] since the plant was switched on.

    `torque` is the motor's as the drive reports it, times the gear ratio.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    torque: NDArray[np.float64]
    time: NDArray[np.float64]
