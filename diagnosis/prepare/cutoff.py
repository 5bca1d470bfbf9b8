"""The cut-off of the comparison: up to where the measured torque still tells something above noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
    """-3 dB frequency of one pass [Hz]: the lowest from 48 Hz on above which no axis's torque varies by more than noise.

    What varies: Welch's density of the torque less its level between 0.4 and 0.48 of the sample rate, which is taken for noise.
    Never above 0.4 of the highest sample rate.
    """
    each = [(recording, axis) for recording in recordings for axis in recording.info.axes]
    highest = max(HIGHEST_SHARE_OF_RATE / recording.info.sample_period for recording in recordings)
    return float(min(highest, max([USUAL, *(_needed(*one) for one in each)])))


def motion_cutoff(recordings: Sequence[Recording], inertia: Mapping[str, float]) -> float:
    """Up to where accelerations are more than noise of the position [Hz]: the motion is filtered there, if that is lower.

    `inertia` of each axis [kg·m² or kg]: noise of the inertial torque is to be at most 2 % of the torque; but as high as the
    position itself stands 20 dB above its noise.
    """
    each = [(recording, axis) for recording in recordings for axis in recording.info.axes]
    highest = [max(_bearable(recording, axis, inertia[axis]), _told(recording, axis)) for recording, axis in each]
    return max(LOWEST, float(np.median(highest)))


def _bearable(recording: Recording, axis: str, inertia: float) -> float:
    """Up to where the inertial torque's noise is at most 2 % of the torque [Hz].

    White noise s of a position, sampled every T, is (2 pi f)² s sqrt(2 f T / 5) in the acceleration up to f.
    """
    period = recording.info.sample_period
    torque = float(np.sqrt(np.mean(recording.columns[axis]["torque"] ** 2)))
    noise = inertia * position_noise(recording, axis) * (2.0 * np.pi) ** 2 * np.sqrt(0.4 * period)
    return float((NOISE_SHARE * torque / noise) ** 0.4) if noise > 0.0 else np.inf


def _told(recording: Recording, axis: str) -> float:
    """The highest frequency [Hz] at which the position's density is 20 dB above its noise's."""
    frequency, density = _density(recording, axis)
    noise = 2.0 * position_noise(recording, axis) ** 2 * recording.info.sample_period
    above = frequency[density > ABOVE_NOISE * noise]
    return float(above.max(initial=0.0))


def position_noise(recording: Recording, axis: str) -> float:
    """Standard deviation of a position's white noise [rad or m], from its density at the upper end of its spectrum."""
    frequency, density = _density(recording, axis)
    rate = 1.0 / recording.info.sample_period
    upper = (frequency >= 0.35 * rate) & (frequency <= 0.48 * rate)
    return float(np.sqrt(np.median(density[upper]) * 0.5 * rate)) if upper.any() else 0.0


def _density(recording: Recording, axis: str) -> tuple[Array, Array]:
    """Frequencies [Hz] and the position's density, (k,), by its fourth differences, which leave no trend to leak."""
    period = recording.info.sample_period
    position = measured_position(recording.columns[axis], period)
    if len(position) < 64:
        return np.zeros(0), np.zeros(0)
    differences = np.diff(position, 4)
    frequency, power = signal.welch(differences, fs=1.0 / period, nperseg=min(512, len(differences)), detrend=False)
    return frequency[1:], power[1:] / (2.0 * np.sin(np.pi * frequency[1:] * period)) ** 8


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
