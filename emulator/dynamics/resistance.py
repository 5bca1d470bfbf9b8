"""Torques on a joint by an equation of state written in Python: effects without a compiled part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.place import Place
from drivetwin.foundation.compiled import in_place


class Resisting(Protocol):
    """Whatever resists a joint."""

    def resistance(
        self, position: NDArray[np.float64], velocity: NDArray[np.float64], time: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Torque (n,) against the joint [N·m or N], of its positions, velocities, and times since power-on, (n,), SI."""
        ...


@in_place
def apply_resistances(dofs, torque, applied) -> None:  # type: ignore[no-untyped-def]
    """Take torques (rows,) off what acts on the joints at `dofs` (rows,)."""
    for row in range(dofs.shape[0]):
        applied[dofs[row]] -= torque[row]


class Resistances:
    """Those of the axes, if any are `present`; `arrays` for `apply_resistances`, of the state when `evaluate` was called."""

    def __init__(self, resisting: Sequence[tuple[Resisting, Place]], data: mujoco.MjData) -> None:
        self._resisting, self._data = resisting, data
        self.present = bool(resisting)
        self.arrays = (np.array([place.dof for _, place in resisting], dtype=np.int64), np.zeros(len(resisting)))

    def evaluate(self) -> None:
        """Their torques at the state in which a step begins."""
        data = self._data
        time = np.array([data.time])
        for row, (one, place) in enumerate(self._resisting):
            position, velocity = data.qpos[place.qpos, None], data.qvel[place.dof, None]
            self.arrays[1][row] = one.resistance(position, velocity, time)[0]
