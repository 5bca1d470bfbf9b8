"""What passes an axis faster than the samples costs other axes: cogging, errors of encoder or gear. All drives answer it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics.motion import Wave
from drivetwin.emulator.dynamics.sampling import Sampling

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def shaken(
    loops: Mapping[str, Sampling], axes: Sequence[str], inertia: Array, axis: str, wave: Wave, rows: NDArray[np.intp]
) -> Complex:
    """Torque (m, k) of all `axes` for a wave of size 1 that passes one of them, at some `rows` (m,); `inertia` (m, k, k) there.
    Axes whose `loops` are unknown stand still.

    Joints x of axes with inertia M and loops C answer a torque d on one of them by (M s² + C) x = d, and an error e, by which
    it is ahead of its reading or its motor, by (M s² + C) x = (C + J s²) e; J is the inertia of a rotor in front of the error.
    Their own torque is M s² x. By what loops answer an axis of inertia I, T, they are C = I s² T / (1 - T). A late reading is
    as late in its loops.
    """
    frequency = wave.frequency[rows]
    moving = [list(axes).index(name) for name in loops]
    own = list(loops).index(axis)
    closed = np.empty((len(frequency), len(moving), len(moving)), dtype=np.complex128)
    error = np.zeros((len(frequency), len(moving)), dtype=np.complex128)
    for row, (name, each) in enumerate(loops.items()):
        given = each.answer(frequency)
        stiff = each.inertia * given
        closed[:, row] = (1.0 - given)[:, None] * inertia[:, moving[row]][:, moving]  # C / s² is not finite where T is 1
        if name == axis:
            stiff = stiff * np.exp(-2j * np.pi * frequency * wave.late)
            error[:, own] = wave.followed * stiff + (1.0 - given) * wave.pushes
            closed[:, own, own] += (1.0 - given) * wave.heavier
        closed[:, row, row] += stiff
    joints = np.linalg.solve(closed, error[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("mij,mj->mi", inertia[:, :, moving], joints))
