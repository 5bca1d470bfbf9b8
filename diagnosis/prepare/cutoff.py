"""The cut-off of the comparison: up to where the measured torque still tells something above noise."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from drivetwin.motion.axis_motion import measured_position
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


def chosen_cutoff(recordings: Sequence[Recording]) -> float:
    """-3 dB frequency of one pass [Hz]: the lowest from 48 Hz on, a fifth above where no axis's torque holds more than 5 %.

    Of what varies beyond noise: Welch's density of the torque less twice its level between 0.4 and 0.48 of the sample rate.
    Never above 0.4 of the highest sample rate.
    """
    each = [(recording, axis) for recording in recordings for axis in recording.info.axes]
    highest = max(HIGHEST_SHARE_OF_RATE / recording.info.sample_period for recording in recordings)
    return float(min(highest, max([USUAL, *(_needed(*one) for one in each)])))


def motion_cutoff(
    recordings: Sequence[Recording], inertia: Mapping[str, float], by_velocity: Collection[str] = frozenset()
) -> float:
    """Up to where accelerations are more than noise [Hz]: the motion is filtered there, if that is lower.

    `inertia` of each axis [kg·m² or kg]: noise of the inertial torque is to be at most 2 % of the torque; but as high as the
    position itself stands 20 dB above its noise. `by_velocity`: axes whose motion is read from the velocity: of that, then.
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

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise, from the density at the upper end of the spectrum."""
        frequency, density = self._density
        rate = 1.0 / self.period
        upper = (frequency >= 0.35 * rate) & (frequency <= 0.48 * rate)
        return float(np.sqrt(np.median(density[upper]) * 0.5 * rate)) if upper.any() else 0.0

    @cached_property
    def _density(self) -> tuple[Array, Array]:
        """Frequencies [Hz] and the density, (k,), by fourth differences of a position, which leave no trend to leak."""
        if len(self.samples) < 64:
            return np.zeros(0), np.zeros(0)
        times = self.order + 2
        differences = np.diff(self.samples, times)
        frequency, power = signal.welch(differences, fs=1.0 / self.period, nperseg=min(512, len(differences)), detrend=False)
        return frequency[1:], power[1:] / (2.0 * np.sin(np.pi * frequency[1:] * self.period)) ** (2 * times)


def _needed(recording: Recording, axis: str) -> float:
    rate = 1.0 / recording.info.sample_period
    torque = recording.columns[axis]["torque"]
    if HIGHEST_SHARE_OF_RATE * rate <= USUAL or len(torque) < 64:
        return 0.0
    moving = _in_motion(recording, axis)
    if moving.sum() < 64:
        return 0.0
    frequency, power = signal.welch(signal.detrend(torque), fs=rate, nperseg=min(_SEGMENT, len(torque)))
    noise = float(np.median(power[(frequency >= 0.4 * rate) & (frequency <= 0.48 * rate)]))
    beyond = np.maximum(power - 2.0 * noise, 0.0) * (frequency >= 1.0)
    above = np.cumsum(beyond[::-1])[::-1]
    quiet = above <= TELLS * max(float(above[0]), np.finfo(float).tiny)
    last = frequency[int(np.argmax(quiet))] if quiet.any() else HIGHEST_SHARE_OF_RATE * rate
    steps = np.ceil(np.log(max(float(last) * 1.2, USUAL) / USUAL) / np.log(STEP) - 1e-9)
    return float(min(USUAL * STEP**steps, HIGHEST_SHARE_OF_RATE * rate))


def _in_motion(recording: Recording, axis: str) -> NDArray[np.bool_]:
    speed = np.abs(np.gradient(measured_position(recording.columns[axis], recording.info.sample_period)))
    return np.asarray(speed > 0.01 * speed.max())
