"""What a second encoder shows of a transmission at once: by how much its joint gives way to torque, and how far it is loose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion

ROUNDING = 1e-9
"""Share of the travel that no encoder resolves: what two differ by less is rounding."""


def stiffness_seen(motion: Motion, axis: AxisDynamics) -> float | None:
    """Of a joint without play [N·m/rad or N/m], by its deflection over the load's torque; None where no encoder shows any."""
    shown = _shown(motion)
    return None if shown is None else _stiffness(_fitted(shown, -_load(motion, axis)[:, None]))


def play_seen(motion: Motion, axis: AxisDynamics) -> tuple[float, float] | None:
    """Gap [rad or m] and stiffness [N·m/rad or N/m] of a joint; None where no encoder shows any.

    By least squares of its deflection on the load's torque and half the sign of that.
    """
    shown = _shown(motion)
    if shown is None:
        return None
    load = _load(motion, axis)
    found = _fitted(shown, -np.column_stack((load, 0.5 * np.sign(load))))
    stiffness, gap = _stiffness(found), float(found[1])
    return (gap, stiffness) if stiffness is not None and gap > 0.0 else None


def _shown(motion: Motion) -> NDArray[np.float64] | None:
    """The deflection (n,) that a second encoder shows; None without one, or where both count alike."""
    if motion.deflection is None or np.ptp(motion.deflection) <= ROUNDING * np.ptp(motion.position):
        return None
    return motion.deflection


def _load(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque (n,) that a rigid gear would pass."""
    return np.asarray(motion.rigid_torque - motion.rotor_inertia * motion.acceleration + axis.friction.resistance(motion))


def _fitted(deflection: NDArray[np.float64], columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of columns (n, k) in a deflection (n,), beside its zero."""
    beside = np.column_stack((columns, np.ones(len(columns))))
    return np.asarray(np.linalg.lstsq(beside, deflection, rcond=None)[0])


def _stiffness(found: NDArray[np.float64]) -> float | None:
    return 1.0 / float(found[0]) if found[0] > 0.0 else None
