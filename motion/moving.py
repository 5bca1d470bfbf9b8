"""Which samples of an axis's motion count: where it moves, and where nothing that it did at rest is smeared into it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.motion.axis_motion import AxisMotion
from drivetwin.motion.filtering import reach
from drivetwin.recording.recording import Samples

Mask = NDArray[np.bool_]

_SHARE_OF_TOP_SPEED = 0.002
_NOISE_FACTOR = 5.0
_MOVES_ABOVE_NOISE = 20.0
_SHARE_OF_LONGEST_STROKE = 0.002
_HARDLY = 0.01
"""Of its highest speed, that an axis which is only shaken nowhere reaches."""
STANDSTILL_REACH = 1.5
"""Filter's reaches left out around a standstill: breaking away is a jump of the torque, of which 2 % still bias."""


@dataclass(frozen=True)
class AxisSamples:
    """A motion with the samples that count: `moving` for errors and gaps, `fitted` for the fit (a subset)."""

    motion: AxisMotion
    moving: Mask
    fitted: Mask


@dataclass(frozen=True)
class Standstill:
    """Where an axis counts as standing: no faster than `velocity` [rad/s or m/s], or shaken by others while its drive holds it.

    Then friction yields and does not slide, and holds any torque. Such a stroke is shorter than `stroke` [rad or m] and nowhere
    faster than `hardly` [rad/s or m/s].
    """

    velocity: float
    stroke: float
    hardly: float


def standstill_velocity(motions: Sequence[AxisMotion]) -> float | None:
    """Speed [rad/s or m/s] above which an axis counts as moving; None where it never moves in any of `motions`."""
    top = _top_speed(motions)
    noise = float(np.median([motion.velocity_noise for motion in motions]))
    if top <= _MOVES_ABOVE_NOISE * noise:
        return None
    return max(_SHARE_OF_TOP_SPEED * top, _NOISE_FACTOR * noise)


def standstill_velocities(motions: Sequence[AxisMotion]) -> list[float]:
    """`standstill_velocity` by what each motion's own noise is; infinite in all where the axis never moves in any."""
    top = _top_speed(motions)
    if top <= _MOVES_ABOVE_NOISE * min(motion.velocity_noise for motion in motions):
        return [np.inf] * len(motions)
    return [max(_SHARE_OF_TOP_SPEED * top, _NOISE_FACTOR * motion.velocity_noise) for motion in motions]


def standstill(motions: Sequence[AxisMotion], velocity: float) -> Standstill:
    """Where an axis stands, below such a speed [rad/s or m/s] and beside its longest stroke and highest speed in `motions`."""
    longest = max(float(np.ptp(motion.position[start:end])) for motion in motions for start, end in _strokes(motion))
    return Standstill(velocity, _SHARE_OF_LONGEST_STROKE * longest, _HARDLY * _top_speed(motions))


def select(motion: AxisMotion, standstill: Standstill, reversal_margin: float) -> AxisSamples:
    """Mark the samples that count.

    Moving: not standing, the filter's reach at both ends left out. Fitted: moving, and further from a standstill
    than 1.5 times the filter's reach, for a standing axis holds an arbitrary torque that the filter smears into the motion, and
    further from a reversal than `reversal_margin` [s]. An axis whose velocity changes sign twice within twice the
    reach counts as standing: it sticks, or is too slow for its encoder.
    """
    inside = _inside(motion)
    slow = (np.abs(motion.velocity) <= standstill.velocity) | shaken(motion, standstill)
    width = reach(motion.period, motion.cutoff_hz)
    standing = _runs_of_at_least(slow, width) | _dithering(motion.velocity, 2 * width)
    reversal = _sign_changes(motion.velocity) | (slow & ~standing)
    margin = round(min(reversal_margin / motion.period, len(motion.time)))
    excluded = widen(standing, round(STANDSTILL_REACH * width))
    if margin:
        excluded |= widen(reversal, margin)
    moving = inside & ~slow
    return AxisSamples(motion, moving, moving & ~excluded)


def shaken(motion: AxisMotion, standstill: Standstill) -> Mask:
    """Strokes in which an axis is held, and gives way."""
    found = np.zeros(len(motion.time), dtype=np.bool_)
    for start, end in _strokes(motion):
        short = np.ptp(motion.position[start:end]) < standstill.stroke
        found[start:end] = short and np.abs(motion.velocity[start:end]).max() < standstill.hardly
    return found


def widen(mask: Mask, width: int) -> Mask:
    """`mask` grown by `width` samples on both sides."""
    count = len(mask)
    width = min(width, count)
    before = np.concatenate(([0], np.cumsum(mask)))
    index = np.arange(count)
    return np.asarray(before[np.minimum(index + width + 1, count)] > before[np.maximum(index - width, 0)])


def _strokes(motion: AxisMotion) -> list[tuple[int, int]]:
    """First sample of each, and the one after its last: what is between two reversals."""
    return list(pairwise([0, *np.flatnonzero(_sign_changes(motion.velocity)), len(motion.time)]))


def _top_speed(motions: Sequence[AxisMotion]) -> float:
    return max(float(np.abs(motion.velocity[_inside(motion)]).max(initial=0.0)) for motion in motions)


def _inside(motion: AxisMotion) -> Mask:
    inside = np.ones(len(motion.time), dtype=np.bool_)
    edge = reach(motion.period, motion.cutoff_hz)
    inside[:edge] = inside[-edge:] = False
    return inside


def _sign_changes(velocity: Samples) -> Mask:
    changed = np.zeros(len(velocity), dtype=np.bool_)
    changed[1:] = velocity[1:] * velocity[:-1] < 0.0
    return changed


def _dithering(velocity: Samples, within: int) -> Mask:
    """The stretches between sign changes that follow each other within so many samples."""
    changes = np.flatnonzero(_sign_changes(velocity))
    between = np.zeros(len(velocity), dtype=np.bool_)
    for start, end in pairwise(changes):
        if end - start <= within:
            between[start:end] = True
    return between


def _runs_of_at_least(mask: Mask, length: int) -> Mask:
    """Those True runs of `mask` that are at least `length` samples long."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    long = np.zeros_like(mask)
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start >= length:
            long[start:end] = True
    return long
