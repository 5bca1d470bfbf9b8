"""Validation recordings that are sampled too slowly to show what was fitted: left out where others are enough.

The torque of a wave or an impact that a fast recording shows lies above half the sample rate of a slow one. There it appears at
another frequency, and the motion between two samples is not known: a right effect leaves more than none.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.recording.recording import Recording

SLOWER = 4.0
"""Times the longest sample period of what is fitted, above which a validation recording is too slow."""
ENOUGH = 1.0 / 3.0
"""Share of the recorded time that the others must hold where recordings are left out."""


def fast_enough(fitted: Sequence[Recording], validation: Sequence[Recording]) -> tuple[list[Recording], tuple[str, ...]]:
    """The validation recordings that can show what was fitted, and a note of those left out; all where too little is left."""
    longest = SLOWER * max(one.info.sample_period for one in fitted)
    kept = [one for one in validation if one.info.sample_period <= longest]
    slow = [one for one in validation if one.info.sample_period > longest]
    if not slow or seconds(kept) < ENOUGH * seconds(validation):
        return list(validation), ()
    rates = ", ".join(f"{one.name} ({1.0 / one.info.sample_period:g} Hz)" for one in slow)
    slowest = SLOWER / longest
    return kept, (f"{rates}: left out of the validation, for what is fitted was sampled at {slowest:g} Hz or faster.",)


def seconds(recordings: Sequence[Recording]) -> float:
    """Recorded time of all together [s]."""
    return sum(len(one.time) * one.info.sample_period for one in recordings)
