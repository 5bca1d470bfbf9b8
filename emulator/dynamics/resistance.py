"""Torques on a joint by an equation of state written in Python: effects without a compiled part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.place import Place


class Resisting(Protocol):
    """Whatever resists a joint."""

    def resistance(
        self, position: NDArray[np.float64], velocity: NDArray[np.float64], time: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Torque (n,) against the joint [N·m or N], of its positions, velocities, and times since power-on, (n,), SI."""
        ...


class Resistances:
    """Those of the axes that have any, evaluated at the state in which a step begins."""

    def __init__(self, resisting: Sequence[tuple[Resisting, Place]], data: mujoco.MjData) -> None:
        self._resisting, self._data = resisting, data

    def act(self) -> None:
        """Add them to what acts in the coming step."""
        data = self._data
        time = np.array([data.time])
        for one, place in self._resisting:
            position, velocity = data.qpos[place.qpos, None], data.qvel[place.dof, None]
            data.qfrc_applied[place.dof] -= one.resistance(position, velocity, time)[0]
