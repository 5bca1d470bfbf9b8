"""Recordings as the reference least squares sees them: motion and torque of one axis, through a filter of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray
from scipy import signal
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HIGHEST_SHARE_OF_RATE = 0.4
"""Of the sample rate, the highest cut-off (contract gap-report/2)."""

EDGE = 3.0
"""Periods of the cut-off at both ends that are not fitted: what the filter makes up there is no measurement."""


@dataclass(frozen=True)
class Band:
    """What is compared of an axis: up to `cutoff_hz`, above `standstill_velocity` [rad/s or m/s]."""

    cutoff_hz: float
    standstill_velocity: float


@dataclass(frozen=True)
class Motion:
    """One axis over one recording, (n,) each in SI units: `raw` is the position as recorded, the rest is filtered.

    `fitted` samples are in motion and not at an end.
    """

    name: str
    period: float
    cutoff_hz: float
    raw: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    fitted: Mask

    def smooth(self, samples: Array) -> Array:
        """Samples (n,) through the filter that the torque went through."""
        return zero_phase(samples, self.period, self.cutoff_hz)

    def at_mean_speed(self) -> Motion:
        """The same as if it had moved at its mean speed throughout: what a model of friction over speed is asked for."""
        mean = np.full_like(self.velocity, self.velocity.mean())
        return replace(self, velocity=mean, acceleration=np.zeros_like(mean))


def zero_phase(samples: Array, period: float, cutoff_hz: float) -> Array:
    """4th-order Butterworth forward and backward over samples (n,) taken every `period` [s] (Gautier 1997), SciPy's."""
    cutoff = _effective(period, cutoff_hz)
    sections = signal.butter(4, cutoff, fs=1.0 / period, output="sos")
    padding = min(round(EDGE / (cutoff * period)), len(samples) - 1)
    return np.asarray(signal.sosfiltfilt(sections, samples, padlen=padding), dtype=np.float64)


def read_motion(recording: Path, band: Band) -> Motion:
    """The one axis of a recording; derivatives are those of a cubic spline through the filtered position."""
    told = json.loads((recording / "recording.json").read_text(encoding="utf-8"))
    (axis,) = told["axes"]
    table = pq.read_table(recording / "signals.parquet")
    columns = {name: np.asarray(table.column(name), dtype=np.float64) for name in table.column_names}
    period = float(told["sample_period"])
    raw = columns.get(f"{axis}.position")
    if raw is None:
        raw = np.asarray(cumulative_trapezoid(columns[f"{axis}.velocity"], dx=period, initial=0), dtype=np.float64)
    position = zero_phase(raw, period, band.cutoff_hz)
    at = np.arange(len(raw)) * period
    spline = CubicSpline(at, position)
    velocity = np.asarray(spline(at, 1), dtype=np.float64)
    fitted = np.abs(velocity) > band.standstill_velocity
    edge = round(EDGE / (_effective(period, band.cutoff_hz) * period))
    fitted[:edge] = fitted[len(fitted) - edge :] = False
    return Motion(
        name=recording.name,
        period=period,
        cutoff_hz=band.cutoff_hz,
        raw=raw,
        position=position,
        velocity=velocity,
        acceleration=np.asarray(spline(at, 2), dtype=np.float64),
        torque=zero_phase(columns[f"{axis}.torque"], period, band.cutoff_hz),
        fitted=fitted,
    )


def _effective(period: float, cutoff_hz: float) -> float:
    return min(cutoff_hz, HIGHEST_SHARE_OF_RATE / period)
