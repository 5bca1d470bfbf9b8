"""Which motion is fitted and which is not, where nobody gave recordings to validate on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.motion.axis_motion import least_samples, measured_position
from drivetwin.recording.recording import Recording

HELD_BACK = 0.25
"""Share at the end of each recording that is held back."""
MANY = 4
"""Recordings, of which one in so many is held back whole."""

MOVES = 0.1
"""Of the longest way of an axis, that it must go in a part of the recordings to move there."""

Split = tuple[list[Recording], list[Recording]]
"""What is fitted, and what is not."""


def hold_back(recordings: Sequence[Recording], cutoff_hz: float) -> Split:
    """Every fourth recording by speed where there are many and every axis then moves in both parts, else the end of each.

    A recording whose end would be too short for the filter is fitted whole.
    """
    if len(recordings) >= MANY:
        whole = _whole(recordings)
        if all(_moves_as_in(part, recordings) for part in whole):
            return whole
    return _ends(recordings, cutoff_hz)


def _moves_as_in(part: Sequence[Recording], recordings: Sequence[Recording]) -> bool:
    """Whether every axis that moves in the recordings moves in a part of them, too: one that only holds its place trembles."""
    whole, own = _travels(recordings), _travels(part)
    return all(own.get(axis, 0.0) >= MOVES * way for axis, way in whole.items())


def _travels(recordings: Sequence[Recording]) -> dict[str, float]:
    """The longest way of each axis in one recording [rad or m]."""
    found: dict[str, float] = {}
    for recording in recordings:
        for axis, columns in recording.columns.items():
            way = float(np.ptp(measured_position(columns, recording.info.sample_period)))
            found[axis] = max(found.get(axis, 0.0), way)
    return found


def _whole(recordings: Sequence[Recording]) -> Split:
    """The slowest and the fastest are always fitted: what happens there is not to be told from the others."""
    by_speed = sorted(recordings, key=_speed)
    held = by_speed[MANY // 2 : -1 : MANY]
    return [one for one in recordings if all(one is not other for other in held)], held


def _ends(recordings: Sequence[Recording], cutoff_hz: float) -> Split:
    fitted, held = [], []
    for one in recordings:
        cut = round(len(one.time) * (1.0 - HELD_BACK))
        if len(one.time) - cut < least_samples(one.info.sample_period, cutoff_hz):
            fitted.append(one)
        else:
            fitted.append(_piece(one, slice(0, cut)))
            held.append(_piece(one, slice(cut, None)))
    return fitted, held


def _speed(one: Recording) -> float:
    """Mean speed of its fastest axis, in the axis's own unit."""
    period = one.info.sample_period
    return max(float(np.mean(np.abs(np.diff(measured_position(columns, period))))) / period for columns in one.columns.values())


def _piece(one: Recording, span: slice) -> Recording:
    columns = {axis: {key: values[span] for key, values in named.items()} for axis, named in one.columns.items()}
    return replace(one, time=one.time[span], columns=columns)
