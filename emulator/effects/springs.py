"""Springs and dampers that a transmission may have, by how they let the link swing on a locked motor."""

from __future__ import annotations

from collections.abc import Iterable
from math import pi

import numpy as np

from emulator.dynamics import Motion


def springs(motion: Motion, frequency: float, damping_ratios: Iterable[float]) -> list[tuple[float, float]]:
    """(stiffness, damping) of springs on which the link swings at `frequency` [Hz]; none where the motor has no inertia."""
    link = float(np.median(motion.inertia)) - motion.rotor_inertia
    if link <= 0.0 or motion.rotor_inertia <= 0.0:
        return []
    swing = 2.0 * pi * frequency
    return [(link * swing**2, 2.0 * ratio * link * swing) for ratio in damping_ratios]
