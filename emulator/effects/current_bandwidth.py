"""A current loop that is slower, or faster, than the drive was commissioned for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, pi
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy import signal

from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects.base import FREQUENCY, DriveEffect, Exciting, Look, Need, Parameter
from drivetwin.emulator.effects.ground import Ground


@dataclass(frozen=True)
class CurrentBandwidth(DriveEffect):
    """Measured torque = demanded torque / (1 + s / (2 pi bandwidth)): -3 dB at `bandwidth`, in place of the commissioned lag.

    A first-order closed current loop, sampled exactly at the servo period.
    """

    name: ClassVar[str] = "current_bandwidth"
    family: ClassVar[str] = "motor and drive"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.DEMAND})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SWEEP})
    by_motion: ClassVar[str] = "steps of the torque offset (60B2h)"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LAG})
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("bandwidth", FREQUENCY, low=1.0, high=4000.0),)

    bandwidth: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, bandwidth=self.bandwidth))

    def respond(self, asked: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        """Exact for straight lines between samples."""
        turned = 2.0 * pi * self.bandwidth * period
        left = exp(-turned)
        mean = (1.0 - left) / turned
        at_rest = signal.lfiltic([1.0 - mean, mean - left], [1.0, -left], [asked[0]], [asked[0]])
        return np.asarray(signal.lfilter([1.0 - mean, mean - left], [1.0, -left], asked, zi=at_rest)[0])

    @classmethod
    def candidates(
        cls, asked: NDArray[np.float64], given: NDArray[np.float64], period: float  # noqa: ARG003
    ) -> Sequence[CurrentBandwidth]:
        return [cls(float(bandwidth)) for bandwidth in np.geomspace(5.0, 500.0, 12)]

    @classmethod
    def drawn(cls, ground: Ground) -> CurrentBandwidth:
        return cls(ground.draw.uniform(0.65, 0.9) * ground.bandwidth / (2.0 * pi))
