"""What the report's pictures show, as arrays: recordings one after the other, the worst window, the map, the spectra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from drivetwin.diagnosis.report.result import Array, Mask, Prediction
from drivetwin.motion.filtering import effective_cutoff

_MOST_POINTS = 40_000
"""Of a line over all of the time; around the window that is opened first every sample is drawn."""
_RATE = 4.0
"""Samples kept a period of the cut-off: what the filter leaves, with room."""
_MAP_POSITIONS, _MAP_SPEEDS = 24, 9
_FEWEST_IN_CELL = 5
_MEANS_EACH_WAY = 20
_SPECTRUM_SECONDS = 2.0


@dataclass(frozen=True)
class Trace:
    """One axis over all validation recordings, one after the other, (n,) each; a row of NaN stands between two.

    `starts` [s] is where each recording begins.
    """

    time: Array
    measured: Array
    before: Array
    after: Array
    position: Array
    velocity: Array
    used: Mask
    starts: tuple[float, ...]

    @property
    def gap_before(self) -> Array:
        """Measured less simulated as it stands; NaN where it does not count."""
        return np.where(self.used, self.measured - self.before, np.nan)

    @property
    def gap_after(self) -> Array:
        """Measured less simulated with the selected effects; NaN where it does not count."""
        return np.where(self.used, self.measured - self.after, np.nan)


@dataclass(frozen=True)
class GapMap:
    """Rms of the gap in cells of position (k,) and velocity (m,) edges, (m - 1, k - 1) each; NaN where too few samples are."""

    position: Array
    velocity: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class Spectra:
    """One-sided densities [(N·m)²/Hz or N²/Hz] of the gap in motion over `frequency` [Hz], and of the noise; (k,) each."""

    frequency: Array
    before: Array
    after: Array
    noise: Array


def trace_of(predictions: Sequence[Prediction], axis: str, cutoff_hz: float) -> Trace:
    """The axis over all recordings, each thinned to what the filter leaves of it at the cut-off that it can have."""
    begin, starts, rows = 0.0, [], []
    for prediction in predictions:
        found = prediction.axes[axis]
        step = max(1, int(1.0 / (_RATE * effective_cutoff(prediction.period, cutoff_hz) * prediction.period)))
        columns = (found.measured, found.before, found.after, found.position, found.velocity, found.used)
        time = begin + prediction.time - prediction.time[0]
        part = np.column_stack([time, *columns])[::step]
        starts.append(begin)
        begin = float(time[-1]) + prediction.period
        rows += [part, np.full((1, part.shape[1]), np.nan)]
    stacked = np.vstack(rows[:-1])
    time, measured, before, after, place, velocity, used = stacked.T
    return Trace(time, measured, before, after, place, velocity, used == 1.0, tuple(starts))


def worst_window(trace: Trace, seconds: float) -> tuple[float, float]:
    """The span of time [s] of this length in which the gap's energy is largest; of all of the time where that is shorter."""
    time = np.maximum.accumulate(np.nan_to_num(trace.time))
    square = np.nan_to_num(trace.gap_before) ** 2
    energy = np.concatenate([[0.0], np.cumsum(square * np.diff(time, prepend=time[0]))])
    starts = time[: max(1, int(np.searchsorted(time, time[-1] - seconds, side="right")))]
    ends = np.searchsorted(time, starts + seconds, side="right")
    begin = float(starts[int(np.argmax(energy[ends] - energy[: len(starts)]))])
    return begin, min(begin + seconds, float(time[-1]))


def drawn(trace: Trace, window: tuple[float, float]) -> NDArray[np.intp]:
    """Samples to draw over time: all of them a window's length around `window`, elsewhere no more than a file can bear."""
    low, high = window
    every = np.arange(len(trace.time)) % max(1, -(-len(trace.time) // _MOST_POINTS)) == 0
    near = np.abs(trace.time - 0.5 * (low + high)) <= 1.5 * (high - low)
    return np.flatnonzero(every | near | np.isnan(trace.time))


def gap_map(trace: Trace) -> GapMap:
    """The map of where: cells of equal width over position, and over velocity in steps that are finer towards standstill."""
    used = trace.used
    position, velocity = trace.position[used], trace.velocity[used]
    across = np.linspace(position.min(), position.max(), _MAP_POSITIONS + 1)
    speed = np.geomspace(max(np.percentile(np.abs(velocity), 2.0), 1e-9), np.abs(velocity).max() * (1.0 + 1e-9), _MAP_SPEEDS)
    along = np.concatenate([-speed[::-1], [0.0], speed])
    count = np.histogram2d(velocity, position, (along, across))[0]

    def rms(gap: Array) -> Array:
        energy = np.histogram2d(velocity, position, (along, across), weights=gap[used] ** 2)[0]
        mean = np.divide(energy, count, out=np.full_like(energy, np.nan), where=count >= _FEWEST_IN_CELL)
        return np.asarray(np.sqrt(mean))

    return GapMap(across, along, rms(trace.gap_before), rms(trace.gap_after))


def spectra_of(predictions: Sequence[Prediction], axis: str, noise_rms: float, cutoff_hz: float) -> Spectra:
    """Welch's estimate of what is left; the gap at rest is taken as 0 and made up for by the share of motion.

    Each recording up to 1.5 times the cut-off that it can have, and half its sample rate; they weigh by their time in motion.
    """
    frequency = np.arange(1.0, 1.5 * cutoff_hz * _SPECTRUM_SECONDS + 1.0) / _SPECTRUM_SECONDS
    before, after, weight = np.zeros((3, len(frequency)))
    for prediction in predictions:
        found = prediction.axes[axis]
        seconds = float(found.used.sum()) * prediction.period
        has = frequency <= min(1.5 * effective_cutoff(prediction.period, cutoff_hz), 0.5 / prediction.period)
        weight[has] += seconds
        for total, simulated in ((before, found.before), (after, found.after)):
            gap = np.where(found.used, found.measured - simulated, 0.0)
            total[has] += seconds * _density(gap, prediction.period, frequency[has]) / max(float(np.mean(found.used)), 1e-9)
    gain = 1.0 / (1.0 + (frequency / cutoff_hz) ** 8) ** 2
    noise = noise_rms**2 * gain / (gain.sum() / _SPECTRUM_SECONDS)
    shown = weight > 0.0
    return Spectra(frequency[shown], before[shown] / weight[shown], after[shown] / weight[shown], noise[shown])


def _density(gap: Array, period: float, at: Array) -> Array:
    length = min(len(gap), round(_SPECTRUM_SECONDS / period))
    frequency, power = signal.welch(gap, fs=1.0 / period, nperseg=length, detrend=False)
    return np.asarray(np.interp(at, frequency, power))


def mean_over(velocity: Array, gap: Array) -> tuple[Array, Array]:
    """Mean gap in steps of velocity, (k,) each; NaN where too few samples are, and between both directions."""
    step = float(np.abs(velocity).max()) / _MEANS_EACH_WAY
    cell = np.clip(np.floor(velocity / step).astype(np.intp) + _MEANS_EACH_WAY, 0, 2 * _MEANS_EACH_WAY - 1)
    count, total = np.bincount(cell, minlength=2 * _MEANS_EACH_WAY), np.bincount(cell, gap, 2 * _MEANS_EACH_WAY)
    mean = np.divide(total, count, out=np.full(len(count), np.nan), where=count >= _FEWEST_IN_CELL)
    centre = (np.arange(len(count)) - _MEANS_EACH_WAY + 0.5) * step
    return np.insert(centre, _MEANS_EACH_WAY, 0.0), np.insert(mean, _MEANS_EACH_WAY, np.nan)
