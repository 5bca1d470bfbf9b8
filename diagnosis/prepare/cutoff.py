"""The cut-off of the comparison: up to where the measured torque still tells something above noise."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from drivetwin.motion.axis_motion import measured_position
from drivetwin.motion.spectrum import density
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

USUAL = 48.0
"""Below it [Hz] no cut-off is chosen where the sample rate bears it: on EMPS it reproduces the published figures."""
HIGHEST_SHARE_OF_RATE = 0.4
TELLS = 0.05
"""Share of the varying torque's power, that torque above a cut-off must hold beyond noise."""
STEP = 2.0**0.25
NOISE_SHARE = 0.02
ABOVE_NOISE = 100.0
LOWEST = 2.0
_SEGMENT = 2048
_FEWEST = 512
"""Samples of a segment in which noise is told from motion, or a second: what leaks from 0 Hz then ends near 5 Hz."""
_SURE = 5.0
"""Standard deviations of a density above noise, from which there is motion: none of some hundred frequencies by chance."""


def chosen_cutoff(recordings: Sequence[Recording]) -> float:
    """-3 dB frequency of one pass [Hz]: the lowest step from 48 Hz on that is at least 1.2 times the frequency above which the
    torque of each axis has at most 5 % of its power.

    Of its power beyond noise in the recording in which the axis varies most: in one that hardly varies, a hum of the servo is
    most of it. Never above 0.4 of the highest sample rate.
    """
    highest = max(HIGHEST_SHARE_OF_RATE / recording.info.sample_period for recording in recordings)
    needed = [USUAL]
    for axis in recordings[0].info.axes:
        spectra = [found for one in recordings if (found := _Spectrum.of(one, axis)) is not None]
        most = max((each.varies for each in spectra), default=0.0)
        needed += [each.needed(TELLS * most) for each in spectra]
    return float(min(highest, max(needed)))


@dataclass(frozen=True)
class _Spectrum:
    """Of a torque that varies beyond noise: its power above each frequency [Hz], (k,) each; `highest` [Hz] to compare."""

    frequency: Array
    above: Array
    highest: float

    @classmethod
    def of(cls, recording: Recording, axis: str) -> _Spectrum | None:
        """Welch's density less twice its level between 0.4 and 0.48 of the sample rate; None where little is told."""
        rate = 1.0 / recording.info.sample_period
        torque, highest = recording.columns[axis]["torque"], HIGHEST_SHARE_OF_RATE * rate
        if highest <= USUAL or len(torque) < 64 or _in_motion(recording, axis).sum() < 64:
            return None
        frequency, power = signal.welch(signal.detrend(torque), fs=rate, nperseg=min(_SEGMENT, len(torque)))
        noise = float(np.median(power[(frequency >= 0.4 * rate) & (frequency <= 0.48 * rate)]))
        beyond = np.maximum(power - 2.0 * noise, 0.0) * (frequency >= 1.0) * (frequency[1] - frequency[0])
        return cls(frequency, np.cumsum(beyond[::-1])[::-1], highest)

    @property
    def varies(self) -> float:
        """The whole power [(N·m)² or N²]."""
        return float(self.above[0])

    def needed(self, telling: float) -> float:
        """The cut-off above which no more than so much power is [Hz]."""
        quiet = self.above <= max(telling, np.finfo(float).tiny)
        last = self.frequency[int(np.argmax(quiet))] if quiet.any() else self.highest
        steps = np.ceil(np.log(max(float(last) * 1.2, USUAL) / USUAL) / np.log(STEP) - 1e-9)
        return float(min(USUAL * STEP**steps, self.highest))


def motion_cutoff(
    recordings: Sequence[Recording], inertia: Mapping[str, float], by_velocity: Collection[str] = frozenset()
) -> float:
    """Up to where accelerations are more than noise [Hz]: the motion is filtered there, if that is lower.

    `inertia` of each axis [kg·m² or kg]: noise of the inertial torque is to be at most 2 % of the torque; but as high as the
    position itself stands 20 dB above its noise. `by_velocity`: axes whose motion is read from the velocity; then the noise is
    the velocity's.
    """
    highest = []
    for recording in recordings:
        for axis in recording.info.axes:
            sensor = Sensor.of(recording, axis, velocity=axis in by_velocity)
            torque = float(np.sqrt(np.mean(recording.columns[axis]["torque"] ** 2)))
            highest.append(max(sensor.bearable(torque, inertia[axis]), sensor.told()))
    return max(LOWEST, float(np.median(highest)))


@dataclass(frozen=True)
class Sensor:
    """Samples (n,) of a position, or a velocity, every `period` [s]; `order`: derivatives that make an acceleration of it."""

    samples: Array
    period: float
    order: int

    @classmethod
    def of(cls, recording: Recording, axis: str, *, velocity: bool) -> Sensor:
        columns, period = recording.columns[axis], recording.info.sample_period
        return cls(columns["velocity"], period, 1) if velocity else cls(measured_position(columns, period), period, 2)

    def bearable(self, torque: float, inertia: float) -> float:
        """Up to where the inertial torque's noise is at most 2 % of the torque [Hz].

        White noise s, sampled every T, is (2 pi f)^k s sqrt(2 f T / (2 k + 1)) in the k-th derivative up to f.
        """
        unit = inertia * self.noise * (2.0 * np.pi) ** self.order * np.sqrt(2.0 * self.period / (2.0 * self.order + 1.0))
        return float((NOISE_SHARE * torque / unit) ** (1.0 / (self.order + 0.5))) if unit > 0.0 else np.inf

    def told(self) -> float:
        """The highest frequency [Hz] at which the density is 20 dB above the noise's."""
        frequency, density = self._density
        above = frequency[density > ABOVE_NOISE * 2.0 * self.noise**2 * self.period]
        return float(above.max(initial=0.0))

    def share_of_motion(self) -> tuple[Array, Array]:
        """Frequencies [Hz] and the share of the power there, (k,) each, that is more than white noise; 0 where none is sure.

        A density averaged over K segments scatters by 1 / sqrt(K) (Welch 1967); overlapping ones count for 0.6.
        """
        frequency, density = self._density
        white = 2.0 * self.noise**2 * self.period
        segments = max(0.6 * (2.0 * len(self.samples) / self._segment - 1.0), 1.0)
        share = 1.0 - white / np.maximum(density, np.finfo(float).tiny)
        return frequency, np.where(density > white * (1.0 + _SURE / np.sqrt(segments)), share, 0.0)

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise, from the density at the upper end of the spectrum."""
        frequency, density = self._density
        rate = 1.0 / self.period
        upper = (frequency >= 0.35 * rate) & (frequency <= 0.48 * rate)
        return float(np.sqrt(np.median(density[upper]) * 0.5 * rate)) if upper.any() else 0.0

    @property
    def _segment(self) -> int:
        return max(_FEWEST, round(1.0 / self.period))

    @cached_property
    def _density(self) -> tuple[Array, Array]:
        """Frequencies [Hz] and the density, (k,), by fourth differences of a position, third of a velocity: no trend leaks."""
        if len(self.samples) < 64:
            return np.zeros(0), np.zeros(0)
        times = self.order + 2
        return density(self.samples, self.period, times, min(self._segment, len(self.samples) - times))


def _in_motion(recording: Recording, axis: str) -> NDArray[np.bool_]:
    speed = np.abs(np.gradient(measured_position(recording.columns[axis], recording.info.sample_period)))
    return np.asarray(speed > 0.01 * speed.max())
