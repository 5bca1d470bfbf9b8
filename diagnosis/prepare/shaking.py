"""What an error of encoder or gear that passes faster than the samples costs other axes: the drives of all axes answer it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.sampling import Sampling

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def shaken(loops: Mapping[str, Sampling], inertia: Array, axis: str, frequency: Array) -> dict[str, Complex]:
    """Torque (m,) that the drive of each other axis gives for a wave of an acceleration of 1 by which encoder or gear of an
    `axis` errs, at a frequency (m,) [Hz]; `inertia` (m, k, k) of the axes with known `loops`. The others stand still.

    Positions x of axes with inertia M and loops C answer an error e of one of them by (M s² + C) x = -C e, with a torque of
    M s² x: M (M s² + C)^-1 C of the error's acceleration.
    """
    names = list(loops)
    own, count = names.index(axis), len(names)
    square = -((2.0 * np.pi * frequency) ** 2)
    stiffness = np.stack([each.stiffness(frequency) for each in loops.values()], axis=1)
    closed = inertia * square[:, None, None] + stiffness[:, :, None] * np.eye(count)
    error = stiffness[:, own, None] * np.eye(count)[own]
    torque = np.einsum("mij,mj->mi", inertia, np.linalg.solve(closed, error[:, :, None])[:, :, 0])
    return {name: torque[:, k] * loops[name].turned(frequency) for k, name in enumerate(names) if k != own}
