"""The torque at the moment of its motion: what the recording says that its channel delays it by is taken back."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from drivetwin.recording.recording import AxisInfo, Recording

Array = NDArray[np.float64]


def delay_of(info: AxisInfo) -> float:
    """By how much the torque column is late [s]: its delay, and 1 / (2 pi f), a low-pass of first order at low frequency."""
    low_pass = 1.0 / (2.0 * pi * info.torque_bandwidth_hz) if info.torque_bandwidth_hz is not None else 0.0
    return (info.torque_delay or 0.0) + low_pass


def torque_of(recording: Recording, axis: str) -> Array:
    """The torque (n,) as early as the motion that needed it [N·m or N], by cubic splines; unchanged if nothing is told."""
    torque, late = recording.columns[axis]["torque"], delay_of(recording.info.axes[axis])
    return earlier(torque, late, recording.info.sample_period) if late else torque


def earlier(torque: Array, late: float, period: float) -> Array:
    """A torque (n,), sampled every `period` [s], as it was `late` [s] after each sample; by cubic splines."""
    return np.asarray(ndimage.shift(torque, -late / period, order=3, mode="nearest"))
