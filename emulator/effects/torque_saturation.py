"""A power stage that gives less current than the drive believes: its loops go on asking for more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects.base import TORQUE, DriveEffect, Exciting, Look, Need, Parameter
from drivetwin.emulator.effects.ground import Ground

_BINS = 200
_TRIES = 6


@dataclass(frozen=True)
class TorqueSaturation(DriveEffect):
    """|motor torque| <= limit, on the joint side, in what the motor gives and in what the drive measures: ideal clipping.

    The drive's own limits, at which its integrators stop, are 6072h, 60E0h and 60E1h (CiA 402-2); this is not one of them.
    """

    name: ClassVar[str] = "torque_saturation"
    family: ClassVar[str] = "motor and drive"
    needs: ClassVar[frozenset[Need]] = frozenset({Need.DEMAND})
    shown_by: ClassVar[frozenset[Exciting]] = frozenset({Exciting.SHORT_MOVES})
    by_motion: ClassVar[str] = "accelerations up to the torque limit, in both directions"
    looks: ClassVar[frozenset[Look]] = frozenset({Look.LAG})
    stops: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("limit", TORQUE, low=1e-6),)

    limit: float

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return replace(axis, motor=replace(axis.motor, current_limit=self.limit))

    def respond(self, asked: NDArray[np.float64], period: float) -> NDArray[np.float64]:
        return np.clip(asked, -self.limit, self.limit)

    @classmethod
    def candidates(
        cls, asked: NDArray[np.float64], given: NDArray[np.float64], period: float  # noqa: ARG003
    ) -> Sequence[TorqueSaturation]:
        """Where what is given heaps up while more is asked; highest first."""
        magnitude = np.abs(given)
        counts, edges = np.histogram(magnitude, bins=_BINS, range=(0.0, max(float(magnitude.max()), 1e-6)))
        heaps = [k for k in range(_BINS // 4, _BINS) if counts[k] == counts[max(0, k - 3) : k + 4].max() and counts[k] > 2]
        tops = [magnitude[(magnitude >= edges[k]) & (magnitude <= edges[k + 1])] for k in reversed(heaps)]
        return [cls(float(top.mean())) for top in tops[:_TRIES]]

    @classmethod
    def drawn(cls, ground: Ground) -> TorqueSaturation:
        asked = np.abs(ground.motion.torque)
        steady = float(asked[np.abs(ground.motion.acceleration) < 0.05 * ground.max_acceleration].max())
        return cls(steady + ground.draw.uniform(0.72, 0.88) * (float(asked.max()) - steady))
