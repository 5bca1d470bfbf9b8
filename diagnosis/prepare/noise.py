"""What no model can explain in the compared band: noise and resolution of the torque sensor, and when samples were taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray
from scipy import signal, stats

from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.filtering import derivative

Array = NDArray[np.float64]

ABOVE = 3.0
"""Noise is read from the torque's spectrum above so many cut-offs, where no motion is."""
TIMING = 0.1
"""Share of a sample period by which position and torque of a sample differ at most in time: what goes beyond is no noise."""
STRETCHES = 100
"""Of motion in a recording, whose spectra are made at most: the median of a hundred errs by an eighth of their scatter."""
FEWEST = 50
"""Second differences that tell a level of noise."""
LOWER_QUARTILE = 0.25
"""Of the density of what is left over the compared band: no pattern fills a whole band."""


@dataclass(frozen=True)
class Noise:
    """Of one axis, rms in the compared band [N·m or N]: noise alone, how it was found, and what a model is expected to miss.

    `by_torque`: the noise that the torque shows by itself. `rms` may be more, the floor of what a set of effects leaves, which
    with too few of them is no noise. `misfit`: what a calibrated model is allowed to miss. `is_named`: effects
    explain a gap that is no larger than what a model is expected to miss.
    """

    rms: float
    found_by: str
    model_error: float
    by_torque: float
    misfit: float
    is_named: bool = False

    @property
    def floor(self) -> float:
        """Both together: what no cause explains; of a small gap with a name, noise alone."""
        return self.rms if self.is_named else self.unasked

    @property
    def unasked(self) -> float:
        """Both together: what is left that nobody asks a name for."""
        return float(np.hypot(self.rms, self.model_error))


def noise_of(axis: str, runs: Sequence[Run], left: Sequence[Array], settings: Settings, apart: float) -> Noise:
    """The largest of three: the torque's white noise, its resolution, and the floor of what is left.

    Two figures bound the white noise from above: the torque above the motion's band, in which slow sampling leaves motion, and
    how much what is left changes from sample to sample.

    `left` (n,) is what stays of each run's torque with everything that was found, NaN where it does not count; the floor of its
    density in the compared band is what no cause makes, for none is spread evenly over frequency. `apart`: time [s] by which
    torque and position of a sample still differ, by the fit.
    """
    powers, floors, quanta, weights, timing = [], [], [], [], []
    for run, rest in zip(runs, left, strict=True):
        torque = run.axes[axis].motion.torque
        quantum = run.recording.info.axes[axis].torque_resolution or 0.0
        quanta.append(quantum**2 / 12.0 * _bandwidth(run) * 2.0 * run.period)
        density = min(float(run.kept(("density", axis), partial(_density, torque, run))), _of_differences(rest, run))
        powers.append(density * _bandwidth(run))
        floors.append(_floor(rest, run))
        weights.append(float(np.isfinite(rest).sum()) * run.period)
        slope = derivative(run.axes[axis].torque, run.period)[run.axes[axis].used]
        timing.append(float(np.mean(slope**2)) * min(apart, TIMING * run.period) ** 2 if slope.size else 0.0)
    weights = weights if any(weights) else [1.0] * len(weights)
    sensor, floor, resolution, of_time = (float(np.average(each, weights=weights)) for each in (powers, floors, quanta, timing))
    rms, alone = (float(np.sqrt(max(sensor, resolution, each) + of_time)) for each in (floor, 0.0))
    found_by = (
        f"spectrum of the torque above {ABOVE:g} cut-offs, or changes from sample to sample of what is left, the lesser, "
        f"taken as white, through the filter: {np.sqrt(sensor):.3g}; "
        f"lower quartile of the spectrum of what is left in the band: {np.sqrt(floor):.3g}; "
        f"resolution: {np.sqrt(resolution):.3g}; {apart * 1e3:.2g} ms between position and torque: {np.sqrt(of_time):.3g}"
    )
    moves = np.concatenate([run.axes[axis].of_motion[run.axes[axis].used] for run in runs])
    size = float(np.sqrt(np.mean(moves**2))) if moves.size else 0.0
    return Noise(rms, found_by, settings.model_error * size, alone, settings.misfit * size)


def _floor(left: Array, run: Run) -> float:
    """Mean square of white noise at the lower quartile of the density of what is left, between 5 % and 90 % of the cut-off."""
    stretches = [part for part in _stretches(left) if len(part) >= int(4.0 / (run.cutoff_hz * run.period)) + 16]
    if not stretches:
        return 0.0
    if len(stretches) > STRETCHES:  # at random: of strokes there and back, every other one goes one way
        drawn = np.random.default_rng(0).permutation(len(stretches))[:STRETCHES]
        stretches = [stretches[number] for number in sorted(drawn.tolist())]
    length = min(256, min(len(part) for part in stretches) if len(stretches) < 4 else 128)
    densities = []
    for part in stretches:
        level = signal.detrend(part)
        frequency, power = signal.welch(level, fs=1.0 / run.period, nperseg=min(length, len(part)), average="median")
        inside = (frequency >= 0.05 * run.cutoff_hz) & (frequency <= 0.9 * run.cutoff_hz)
        gain = 1.0 / (1.0 + (frequency[inside] / run.cutoff_hz) ** 8) ** 2
        if inside.any():
            averaged = max(2.0, 0.6 * 2.0 * (2.0 * len(part) / min(length, len(part)) - 1.0))
            densities.append(np.quantile(power[inside] / gain, LOWER_QUARTILE) / _expected(averaged))
    return float(np.median(densities)) * _bandwidth(run) if densities else 0.0


@lru_cache(maxsize=256)
def _expected(averaged: float) -> float:
    """The lower quartile of the density of white noise over so many degrees of freedom, a share of the density."""
    return float(stats.chi2.ppf(LOWER_QUARTILE, averaged) / averaged)


def _stretches(left: Array) -> list[Array]:
    """The parts of it without NaN."""
    there = np.concatenate(([0], np.isfinite(left).astype(np.int8), [0]))
    edges = np.flatnonzero(np.diff(there))
    return [left[start:end] for start, end in zip(edges[::2], edges[1::2], strict=True)]


def _density(torque: Array, run: Run) -> Array:
    """Median one-sided power density [(N·m)²/Hz] above the motion's band, or of the upper fifth where the rate is too low."""
    rate = 1.0 / run.period
    frequency, power = signal.welch(torque, fs=rate, nperseg=min(1024, len(torque)))
    lowest = min(ABOVE * run.cutoff_hz, 0.4 * rate)
    high = power[(frequency >= lowest) & (frequency <= 0.48 * rate)]
    return np.asarray(np.median(high))


def _of_differences(left: Array, run: Run) -> float:
    """Power density [(N·m)²/Hz] of white noise of which second differences would be as large as those of what is left.

    Gasser, Sroka, Jennen-Steinmetz, Biometrika 73(3), 1986; by their median, which steps here and there do not raise. Infinite
    where there are too few.
    """
    second = np.diff(left, 2)
    squares = second[np.isfinite(second)] ** 2
    if len(squares) < FEWEST:
        return float("inf")
    frequency, power = _passed(run)
    differenced = np.sum(power * (2.0 * np.sin(np.pi * frequency * run.period)) ** 4) * (frequency[1] - frequency[0])
    return float(np.median(squares) / stats.chi2.median(1) / differenced)


def _bandwidth(run: Run) -> float:
    """Noise bandwidth of the zero-phase filter [Hz]: integral of its gain to the fourth over frequency."""
    frequency, power = _passed(run)
    return float(np.sum(power) * (frequency[1] - frequency[0]))


def _passed(run: Run) -> tuple[Array, Array]:
    """Frequencies [Hz] up to half the sample rate, and the share of a power that passes the zero-phase filter."""
    frequency = np.linspace(0.0, 0.5 / run.period, 2000)[:-1]
    gain = 1.0 / (1.0 + (np.tan(np.pi * frequency * run.period) / np.tan(np.pi * run.cutoff_hz * run.period)) ** 8)
    return frequency, gain**2
