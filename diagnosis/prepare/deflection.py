"""What a second encoder adds: how far each joint is ahead of its motor, compared on rows beside those of torque."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.motion.filtering import zero_phase
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]
Index = NDArray[np.intp]

JOINT = "joint_position"
_OF = "deflection of "


def deflection_of(axis: str) -> str:
    """Name of the rows on which an axis's deflection is compared."""
    return _OF + axis


def axis_of(rows: str) -> str:
    """The axis that rows are of, of its torque or of its deflection."""
    return rows.removeprefix(_OF)


def is_torque(rows: str) -> bool:
    """Whether rows are of torque, which a gap is of."""
    return not rows.startswith(_OF)


def deflection(recording: Recording, axis: str, position: Array, period: float, cutoff_hz: float) -> Array | None:
    """How far the joint is ahead of its motor at `position` (n,), through the filter of the comparison [rad or m].

    Less its mean, for two encoders have no zero in common. None where no second encoder was recorded, or one that misses a
    sample.
    """
    joint = recording.columns[axis].get(JOINT)
    if joint is None or not np.isfinite(joint).all():
        return None
    ahead = zero_phase(joint - position, period, cutoff_hz)
    return np.asarray(ahead - np.mean(ahead))


def centred(rows: Array, run: Index) -> Array:
    """Rows (N,) less their mean in each recording, by its number `run` (N,): two encoders have no zero in common."""
    if not len(rows):
        return rows
    count = np.maximum(np.bincount(run), 1)
    return np.asarray(rows - (np.bincount(run, weights=rows) / count)[run])
