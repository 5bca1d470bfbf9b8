"""Do the recordings move enough to answer? Where they do not, what is missing is said: how long, which way, which speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.result import Array
from drivetwin.motion.axis_motion import (
    AxisMotion,
    least_samples,
    measured_position,
    select,
    standstill_velocity,
    velocity_noise,
)
from drivetwin.motion.filtering import derivative, effective_cutoff, zero_phase
from drivetwin.recording.recording import Recording

LEAST_TO_FIT = 2.0
LEAST_TO_VALIDATE = 0.5
"""Of motion, an axis [s]."""
LEAST_EACH_WAY = 0.2
"""Below it [s] an axis does not count as moving that way."""
SPEED_RANGE = 1.5
"""Ratio of the 95th to the 5th percentile of the speed, below which all motion is at one speed."""


@dataclass(frozen=True)
class _Moved:
    """Of one axis over some recordings: time, time in motion, either way [s], and the ratio of its fast speeds to its slow."""

    seconds: float
    moving: float
    forwards: float
    backwards: float
    speed_range: float


def too_still(training: Sequence[Recording], validation: Sequence[Recording], cutoff_hz: float) -> str | None:
    """Why they cannot be answered from: a recording too short for the filter, or an axis that moves too little; None: they can.

    To fit, an axis has to move for 2 s in all, at two speeds (by a factor of 1.5) or in both directions; to validate, 0.5 s.
    """
    for recording in (*training, *validation):
        if short := _too_short(recording, cutoff_hz):
            return short
    for axis in training[0].info.axes:
        moved = _moved(training, axis, cutoff_hz)
        if missing := _missing_to_fit(moved):
            return _message(training, axis, moved, missing)
        held = _moved(validation, axis, cutoff_hz)
        if held.moving < LEAST_TO_VALIDATE:
            missing = [f"{LEAST_TO_VALIDATE - held.moving:.2f} s of motion to validate on"]
            return _message(validation, axis, held, missing)
    return None


def _missing_to_fit(moved: _Moved) -> list[str]:
    one_way = min(moved.forwards, moved.backwards) < LEAST_EACH_WAY
    one_speed = moved.speed_range < SPEED_RANGE
    missing = []
    if moved.moving < LEAST_TO_FIT:
        missing.append(f"{LEAST_TO_FIT - moved.moving:.2f} s of motion")
    if moved.moving < LEAST_TO_FIT or (one_way and one_speed):
        missing += ["motion backwards"] if moved.backwards < LEAST_EACH_WAY else []
        missing += ["motion forwards"] if moved.forwards < LEAST_EACH_WAY else []
        missing += [f"a second speed, {SPEED_RANGE:g} times the first or more"] if one_speed else []
    return missing


def _message(recordings: Sequence[Recording], axis: str, moved: _Moved, missing: Sequence[str]) -> str:
    named = ", ".join(recording.name for recording in recordings[:3]) + (", ..." if len(recordings) > 3 else "")
    subject = f"recording{'s' if len(recordings) > 1 else ''} {named}: axis {axis}"
    return (
        f"{subject} moves {moved.moving:.2f} s of {moved.seconds:.3g} s; missing: {', '.join(missing)}. Record strokes to and "
        "fro at several speeds, slow ones and reversals among them, or take the axis out of recording.json"
    )


def _too_short(recording: Recording, cutoff_hz: float) -> str | None:
    period = recording.info.sample_period
    least = least_samples(period, cutoff_hz)
    if len(recording.time) >= least:
        return None
    return (
        f"recording '{recording.name}' has {len(recording.time)} samples; the filter needs at least {least} "
        f"({least * period:.2g} s): record longer or raise the cut-off with --cutoff"
    )


def _moved(recordings: Sequence[Recording], axis: str, cutoff_hz: float) -> _Moved:
    motions = [_motion(recording, axis, cutoff_hz) for recording in recordings]
    threshold = standstill_velocity(motions)
    seconds = sum(len(motion.time) * motion.period for motion in motions)
    if threshold is None:
        return _Moved(seconds, 0.0, 0.0, 0.0, 1.0)
    velocity = [motion.velocity[select(motion, threshold, 0.0).moving] for motion in motions]
    speed = np.abs(np.concatenate(velocity))
    low, high = np.percentile(speed, [5.0, 95.0]) if speed.size else (1.0, 1.0)

    def time(of: Sequence[Array]) -> float:
        return float(sum(motion.period * len(samples) for motion, samples in zip(motions, of, strict=True)))

    ways = time([each[each > 0.0] for each in velocity]), time([each[each < 0.0] for each in velocity])
    return _Moved(seconds, time(velocity), *ways, float(high / low))


def _motion(recording: Recording, axis: str, cutoff_hz: float) -> AxisMotion:
    """The axis alone, without the model: what tells motion from standstill."""
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    raw = measured_position(recording.columns[axis], period)
    position = zero_phase(raw, period, cutoff)
    velocity = derivative(position, period)
    return AxisMotion(
        recording=recording.name,
        axis=axis,
        period=period,
        cutoff_hz=cutoff,
        time=recording.time,
        position=position,
        velocity=velocity,
        acceleration=derivative(velocity, period),
        torque=recording.columns[axis]["torque"],
        model_torque=np.zeros_like(position),
        velocity_noise=velocity_noise(recording, axis, raw, position, cutoff),
    )
