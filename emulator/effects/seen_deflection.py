"""What a second encoder shows of a transmission at once: by how much its joint gives way to torque, and how far it is loose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.dynamics.carried import carried

MOSTLY = (0.01, 0.99)
"""Quantiles between which a deflection and a load are looked at: impacts go farther."""
GAPS = (0.5, 0.75, 0.9)
"""Shares of a joint's span that may be its gap."""
ROUNDING = 1e-12
"""Of the largest position: what two encoders differ by less is rounding."""


def stiffness_seen(motion: Motion, axis: AxisDynamics) -> float | None:
    """Of a joint without play [N·m/rad or N/m], by its deflection over the load's torque; None where no encoder shows any."""
    shown = _shown(motion)
    return None if shown is None else _stiffness(_fitted(shown, -_load(motion, axis)[:, None]))


def plays_seen(motion: Motion, axis: AxisDynamics) -> list[tuple[float, float]]:
    """Gaps [rad or m] and stiffnesses [N·m/rad or N/m] of joints that span as much; none if no encoder shows any.

    From flank to flank a joint spans its gap and what both flanks give under the load. Only a replay shows how much is which.
    """
    shown = _shown(motion)
    if shown is None:
        return []
    span = float(np.ptp(np.quantile(shown, MOSTLY)))
    load = float(np.ptp(np.quantile(_load(motion, axis), MOSTLY)))
    return [(share * span, load / ((1.0 - share) * span)) for share in GAPS] if span > 0.0 and load > 0.0 else []


def _shown(motion: Motion) -> NDArray[np.float64] | None:
    """The deflection (n,) that a second encoder shows; None without one, or where both count alike."""
    if motion.deflection is None or np.ptp(motion.deflection) <= ROUNDING * np.abs(motion.position).max():
        return None
    return motion.deflection


def _load(motion: Motion, axis: AxisDynamics) -> NDArray[np.float64]:
    """Torque (n,) that a rigid gear would pass."""
    needed = carried(motion, axis)
    return np.asarray(needed.rigid_torque - needed.rotor_inertia * motion.acceleration + axis.friction.resistance(needed))


def _fitted(deflection: NDArray[np.float64], columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of columns (n, k) in a deflection (n,), beside its zero."""
    beside = np.column_stack((columns, np.ones(len(columns))))
    return np.asarray(np.linalg.lstsq(beside, deflection, rcond=None)[0])


def _stiffness(found: NDArray[np.float64]) -> float | None:
    return 1.0 / float(found[0]) if found[0] > 0.0 else None
