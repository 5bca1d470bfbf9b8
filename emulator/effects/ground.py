"""What an effect is drawn for, where a test wants one of a size that matters: an axis, the motion asked of it, and chance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion

SHARE = (0.09, 0.25)
"""Torque of an effect as a share of the axis's, both rms while it moves."""

SEEN = 40.0
"""What swings faster [Hz] is hardly in the band in which torques are compared."""


@dataclass(frozen=True)
class Site:
    """Where an axis stands in its machine: its number in the chain of `axes`, and whether it and the one before it slide.

    `weight`: the most torque that gravity asks of it at rest [N·m or N].
    """

    number: int
    axes: int
    slide: bool
    after_slide: bool
    weight: float


@dataclass(frozen=True)
class Ground:
    """An axis as the model has it, on the motion (n,) that is asked of it; joint side, SI.

    `moving` (n,): where it does not stand; `bandwidth` [rad/s] of its velocity loop; `load_at` [m]: where its outermost body
    could carry something; `of_bodies`: the torque (n,) that an effect on the rigid bodies costs it (`Any`: effects
    stand above the ground that they are drawn for).
    """

    draw: np.random.Generator
    motion: Motion
    moving: NDArray[np.bool_]
    axis: AxisDynamics
    travel: tuple[float, float]
    max_speed: float
    max_acceleration: float
    bandwidth: float
    load_at: tuple[float, float, float]
    of_bodies: Callable[[Any], NDArray[np.float64]]

    @property
    def middle(self) -> float:
        """Of its travel."""
        return 0.5 * (self.travel[0] + self.travel[1])

    @property
    def room(self) -> float:
        """Length of its travel."""
        return self.travel[1] - self.travel[0]

    @property
    def inertia(self) -> float:
        """d torque / d acceleration with the rotor, at the middle of what the motion meets [kg·m² or kg]."""
        return float(np.median(self.motion.inertia))

    @property
    def rotor(self) -> float:
        """Inertia of the rotor at the joint."""
        return self.motion.rotor_inertia

    @property
    def links(self) -> float:
        """Inertia of what the transmission moves."""
        return self.inertia - self.rotor

    @property
    def torque_rms(self) -> float:
        """Of the motor while the axis moves [N·m or N]."""
        return self.rms(self.motion.torque)

    def rms(self, values: NDArray[np.float64]) -> float:
        """Of what the axis has (n,) while it moves."""
        return float(np.sqrt(np.mean(values[self.moving] ** 2)))

    def share(self) -> float:
        """How much the effect is to cost."""
        return float(self.draw.uniform(*SHARE))

    def sign(self) -> float:
        """Plus or minus 1."""
        return float(self.draw.choice((-1.0, 1.0)))

    def phase(self) -> float:
        """Any [rad]."""
        return float(self.draw.uniform(-pi, pi))

    def size(self, regressor: NDArray[np.float64]) -> float:
        """Factor at which `regressor` (n,) costs its share."""
        return self.share() * self.torque_rms / self.rms(regressor)

    def changed(self, value: float, regressor: NDArray[np.float64], floor: float = 0.3) -> float:
        """A parameter of the model changed either way by what costs its share, and at least to `floor` times itself."""
        change = self.size(regressor)
        return value - change if self.draw.random() < 0.5 and change < (1.0 - floor) * value else value + change

    def spring(self, frequency: float, damping_ratio: float) -> tuple[float, float]:
        """Stiffness and damping between rotor and links that swing at `frequency` [Hz]."""
        between = self.rotor * self.links / self.inertia
        stiffness = between * (2.0 * pi * frequency) ** 2
        return stiffness, 2.0 * damping_ratio * sqrt(stiffness * between)

    def wave(self, order: float) -> NDArray[np.float64]:
        """Angular frequency (n,) [rad/s] of what comes `order` times a motor turn; 0 where it is too fast to be seen."""
        frequency = order * self.axis.gear_ratio * np.abs(self.motion.velocity)
        return np.where(frequency < 2.0 * pi * SEEN, frequency, 0.0)
