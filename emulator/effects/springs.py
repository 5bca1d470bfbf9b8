"""Springs and dampers that a transmission may have, by how they let the link swing on a locked motor."""

from __future__ import annotations

from collections.abc import Iterable
from math import log, pi, sqrt

import numpy as np

from drivetwin.emulator.dynamics import Motion


def springs(motion: Motion, frequency: float, damping_ratios: Iterable[float]) -> list[tuple[float, float]]:
    """(stiffness, damping) of springs on which the link swings at `frequency` [Hz]; none where the motor has no inertia."""
    link = float(np.median(motion.inertia)) - motion.rotor_inertia
    if link <= 0.0 or motion.rotor_inertia <= 0.0:
        return []
    swing = 2.0 * pi * frequency
    return [(link * swing**2, 2.0 * ratio * link * swing) for ratio in damping_ratios]


def damped(motion: Motion, stiffness: float, damping_ratios: Iterable[float]) -> list[tuple[float, float]]:
    """(stiffness, damping) of a spring; none where the motor has no inertia."""
    link = float(np.median(motion.inertia)) - motion.rotor_inertia
    if link <= 0.0 or motion.rotor_inertia <= 0.0:
        return []
    return [(stiffness, 2.0 * ratio * sqrt(link * stiffness)) for ratio in damping_ratios]


def tenth_of_critical(motion: Motion, stiffness: float) -> float:
    """Damping of a spring [N·m·s/rad or N·s/m] that changes what it does: a step for one that is 0."""
    return 0.2 * sqrt(max(float(np.median(motion.inertia)) - motion.rotor_inertia, 0.0) * stiffness)


_SOFT = 8.0
"""Frequency [Hz] at which a link swings on a transmission that hardly any servo axis is softer than."""


def too_soft(motion: Motion, stiffness: float) -> float:
    """How rare a spring is on which the link swings so slowly [nats]: log-normal below 8 Hz, with a factor of 1.5."""
    link = float(np.median(motion.inertia)) - motion.rotor_inertia
    if link <= 0.0:
        return 0.0
    swing = sqrt(stiffness / link) / (2.0 * pi)
    return 0.5 * (max(0.0, log(_SOFT / swing)) / log(1.5)) ** 2
