"""Steady-state strokes: the stretches of constant speed, each one point of the torque-speed curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin.identification.least_squares import Solution
from drivetwin.identification.model_scale import rest_torque
from drivetwin.identification.regressors import Term
from drivetwin.motion.moving import AxisSamples, Mask
from drivetwin.recording.recording import Samples

_LEAST_SECONDS = 0.1
_LEAST_SAMPLES = 20
_SPEED_TOLERANCE = 0.05
_WINDOW = 0.04
_WINDOW_SAMPLES = 10


@dataclass(frozen=True)
class Stroke:
    """Mean `velocity` [rad/s or m/s] and friction `torque` [N·m or N] of one stroke; the model's torque is taken off.

    `standard_error` is that of the mean torque, autocorrelation included (means of batches of two correlation times of
    the filter).
    """

    recording: str
    start: float
    duration: float
    velocity: float
    torque: float
    standard_error: float

    def to_json(self) -> dict[str, Any]:
        """SI units."""
        return dict(vars(self))


def find_strokes(samples: Sequence[AxisSamples], inertia: float, found: Solution) -> tuple[Stroke, ...]:
    """All strokes of an axis. `inertia` [kg·m² or kg]: the model's at qpos0, in whose place stands the one `found`."""
    return tuple(stroke for entry in samples for stroke in _strokes(entry, inertia, found))


def _strokes(samples: AxisSamples, inertia: float, found: Solution) -> list[Stroke]:
    motion = samples.motion
    rest = (1.0 + found.value(Term.MODEL_SCALE)) * rest_torque(motion, inertia)
    friction = motion.torque - rest - found.value(Term.INERTIA) * motion.acceleration
    steady = _steady(samples)
    least = max(_LEAST_SECONDS / motion.period, _LEAST_SAMPLES)
    strokes = []
    for start, end in _joined(_runs(steady), motion.velocity):
        if end - start < least:
            continue
        part = slice(start, end)
        strokes.append(
            Stroke(
                recording=motion.recording,
                start=float(motion.time[start]),
                duration=float((end - start) * motion.period),
                velocity=float(np.mean(motion.velocity[part])),
                torque=float(np.mean(friction[part])),
                standard_error=_standard_error(friction[part], round(2.0 / (motion.cutoff_hz * motion.period))),
            )
        )
    return strokes


def _runs(mask: Mask) -> list[tuple[int, int]]:
    """Start and end of each True run."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(start), int(end)) for start, end in zip(edges[::2], edges[1::2], strict=True)]


def _joined(runs: list[tuple[int, int]], velocity: Samples) -> list[tuple[int, int]]:
    """`runs` with those made one between which the mean speed stays the same: ripple, not another stroke."""
    joined: list[tuple[int, int]] = []
    for start, end in runs:
        if joined:
            before = float(np.mean(velocity[slice(*joined[-1])]))
            between = float(np.mean(velocity[joined[-1][1] : start]))
            after = float(np.mean(velocity[start:end]))
            if max(abs(between - before), abs(after - before)) < _SPEED_TOLERANCE * abs(before):
                joined[-1] = (joined[-1][0], end)
                continue
        joined.append((start, end))
    return joined


def _steady(samples: AxisSamples) -> Mask:
    """Samples in which the speed, averaged over 0.04 s or 10 samples, changes by less than 5 % in twice that time."""
    motion = samples.motion
    half = max(_WINDOW_SAMPLES, round(_WINDOW / motion.period))
    if len(motion.velocity) <= 4 * half:
        return np.zeros_like(samples.fitted)
    window = np.ones(half) / half
    mean = np.convolve(np.pad(motion.velocity, half, mode="edge"), window, mode="same")[half:-half]
    change = np.zeros_like(mean)
    change[half:-half] = np.abs(mean[2 * half :] - mean[: -2 * half])
    return np.asarray(samples.fitted & (change < _SPEED_TOLERANCE * np.abs(mean)))


def _standard_error(values: Samples, batch: int) -> float:
    """Standard error of the mean of correlated `values` by batch means."""
    count = max(len(values) // max(batch, 1), 1)
    if count < 2:
        return float(np.std(values))
    means = values[: count * (len(values) // count)].reshape(count, -1).mean(axis=1)
    return float(np.std(means, ddof=1) / np.sqrt(count))
