"""Play between motor and joint: they meet on one flank or the other, and part in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from emulator.dynamics import AxisDynamics, Motion
from emulator.dynamics.replay import replayed
from emulator.effects.base import DAMPING, POSITION, STIFFNESS, Parameter, ReplayedEffect, Start
from emulator.effects.springs import springs
from emulator.effects.waves import travel

_FLANKS = (15.0, 45.0)
"""How fast the link swings on a flank of a locked motor [Hz]."""
_CROSSING_TIMES = (0.003, 0.08)
"""From flank to flank [s]."""
_GAPS = 20


@dataclass(frozen=True)
class Backlash(ReplayedEffect):
    """Torque = 0 while |m - q| < gap / 2, else stiffness (|m - q| - gap / 2) sgn(m - q) + damping (m' - q'), which never pulls.

    m, q and the sides of armature and friction as with `elasticity`, whose compliance adds. `gap` is the whole lost motion.
    The dead zone of Nordin and Gutman, Automatica 38(10), 2002.
    """

    name: ClassVar[str] = "backlash"
    family: ClassVar[str] = "transmission"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("gap", POSITION, low=0.0),
        Parameter("stiffness", STIFFNESS, low=1e-3),
        Parameter("damping", DAMPING, low=0.0),
    )

    gap: float
    stiffness: float
    damping: float = 0.0

    def add_to(self, spec: mujoco.MjSpec, joint: mujoco.MjsJoint, axis: AxisDynamics) -> AxisDynamics:
        return self._on(axis)

    def replay(self, motion: Motion, axis: AxisDynamics) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return replayed(motion, self._on(axis))

    @classmethod
    def starts(cls, motion: Motion, axis: AxisDynamics) -> Sequence[Start]:  # noqa: ARG003
        """By how long a link that coasts takes from flank to flank while the motor turns back."""
        turns = float(np.sqrt(np.mean(motion.acceleration**2)))
        gaps = 0.5 * turns * np.geomspace(*_CROSSING_TIMES, _GAPS) ** 2
        flanks = [spring for at in _FLANKS for spring in springs(motion, at, (0.5,))]
        return [cls._start(float(gap), flank) for flank in flanks for gap in gaps if gap < 0.1 * travel(motion)]

    @classmethod
    def _start(cls, gap: float, flank: tuple[float, float]) -> Start:
        """What it costs grows about as the gap."""

        def compose(found: Sequence[float]) -> Backlash | None:
            return cls(gap * min(max(found[0], 0.8), 1.25), *flank) if found[0] > 0.0 else None

        return Start((cls(gap, *flank),), compose)

    def _on(self, axis: AxisDynamics) -> AxisDynamics:
        meshing = axis.transmission.in_series(self.stiffness, self.damping)
        return replace(axis, transmission=replace(meshing, gap=self.gap))
