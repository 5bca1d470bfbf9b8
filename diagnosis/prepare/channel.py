"""The torque as its channel recorded it, in steps and late: what the recording says that it is delayed by is taken back."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from drivetwin.motion.earlier import earlier
from drivetwin.recording.recording import AxisInfo, Recording

Array = NDArray[np.float64]


def delay_of(info: AxisInfo) -> float:
    """By how much the torque column is late [s]: its delay, and 1 / (2 pi f), a low-pass of first order at low frequency."""
    low_pass = 1.0 / (2.0 * pi * info.torque_bandwidth_hz) if info.torque_bandwidth_hz is not None else 0.0
    return (info.torque_delay or 0.0) + low_pass


def torque_of(recording: Recording, axis: str) -> Array:
    """The torque (n,) as early as the motion that needed it [N·m or N]; unchanged if nothing is told."""
    torque, late = recording.columns[axis]["torque"], delay_of(recording.info.axes[axis])
    return earlier(torque, late, recording.info.sample_period) if late else torque


def step_of(torque: Array) -> float:
    """The least by which a recorded torque (n,) changes from one sample to the next; 0 if it never does [N·m or N]."""
    changes = np.abs(np.diff(torque))
    return float(changes[changes > 0.0].min(initial=np.inf)) if changes.any() else 0.0


def unchanged(torque: Array, period: float) -> Array:
    """How long a recorded torque stays as it is around each sample (n,) [s]."""
    begins = np.flatnonzero(np.diff(torque, prepend=np.nan) != 0.0)
    lengths = np.diff(begins, append=len(torque))
    return np.asarray(np.repeat(lengths, lengths) * period)
