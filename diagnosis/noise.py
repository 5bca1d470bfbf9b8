"""What no model can explain in the compared band: noise and resolution of the torque sensor, and when samples were taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from diagnosis.measured import Run
from drivetwin.motion.filtering import derivative

Array = NDArray[np.float64]

ABOVE = 3.0
"""Noise is read from the torque's spectrum above so many cut-offs, where no motion is."""
MODEL_FLOOR = 0.012
"""Share of the torque's standard deviation that the comparison itself errs by: measured on plants without any gap."""
WEIGHT_FLOOR = 0.007
"""The same of the torque's mean, which a weight holds up."""
TIMING = 0.1
"""Share of a sample period within which position and torque of a sample are not known to be of the same instant."""


@dataclass(frozen=True)
class Noise:
    """Of one axis: rms in the compared band [N·m or N], and how it was found; `floor`: with the comparison's own errors."""

    rms: float
    found_by: str
    floor: float


def noise_of(axis: str, runs: Sequence[Run]) -> Noise:
    """White noise at the level of the torque's spectrum above the motion, through the filter; at least the resolution's."""
    powers, weights, timing = [], [], []
    quantum = 0.0
    for run in runs:
        torque = run.axes[axis].motion.torque
        quantum = max(quantum, run.recording.info.axes[axis].torque_resolution or 0.0)
        powers.append(_density(torque, run) * _bandwidth(run))
        weights.append(len(torque) * run.period)
        slope = derivative(run.axes[axis].torque, run.period)[run.axes[axis].used]
        timing.append(float(np.mean(slope**2)) * (TIMING * run.period) ** 2 if slope.size else 0.0)
    band = _bandwidth(runs[0]) * 2.0 * runs[0].period
    sensor = float(np.average(powers, weights=weights))
    resolution = quantum**2 / 12.0 * band
    of_time = float(np.average(timing, weights=weights))
    rms = float(np.sqrt(max(sensor, resolution) + of_time))
    told = (
        f"spectrum of the torque above {ABOVE:g} cut-offs, taken as white, through the filter: {np.sqrt(sensor):.3g}; "
        f"resolution: {np.sqrt(resolution):.3g}; {TIMING:g} of a sample between position and torque: {np.sqrt(of_time):.3g}"
    )
    compared = np.concatenate([run.axes[axis].torque[run.axes[axis].used] for run in runs])
    error = float(np.hypot(MODEL_FLOOR * np.std(compared), WEIGHT_FLOOR * np.mean(compared))) if compared.size else 0.0
    told += f"; own errors, {MODEL_FLOOR:.1%} of the torque's deviation and {WEIGHT_FLOOR:.1%} of its mean: {error:.3g}"
    return Noise(rms, told, float(np.hypot(rms, error)))


def _density(torque: Array, run: Run) -> float:
    """Median one-sided power density [(N·m)²/Hz] above the motion's band, or of the upper fifth where the rate is too low."""
    rate = 1.0 / run.period
    frequency, power = signal.welch(torque, fs=rate, nperseg=min(1024, len(torque)))
    lowest = min(ABOVE * run.cutoff_hz, 0.4 * rate)
    high = power[(frequency >= lowest) & (frequency <= 0.48 * rate)]
    return float(np.median(high))


def _bandwidth(run: Run) -> float:
    """Noise bandwidth of the zero-phase filter [Hz]: integral of its gain to the fourth over frequency."""
    frequency = np.linspace(0.0, 0.5 / run.period, 2000)
    gain = 1.0 / (1.0 + (np.tan(np.pi * frequency[:-1] * run.period) / np.tan(np.pi * run.cutoff_hz * run.period)) ** 8)
    return float(np.sum(gain**2) * (frequency[1] - frequency[0]))
