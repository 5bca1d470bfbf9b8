"""Where a joint is shaken against its motor faster than it is sampled: no sample tells the torque of an impact on a flank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.deflection import JOINT
from drivetwin.diagnosis.prepare.run import AxisRun, Run
from drivetwin.motion.axis_motion import measured_position
from drivetwin.motion.filtering import reach
from drivetwin.motion.moving import widen

Mask = NDArray[np.bool_]

ENOUGH = 0.25
"""Of the samples that count, that must be left: a joint that is shaken everywhere has to be compared as it is."""


def without_shaken(runs: Sequence[Run], cutoff_hz: float, errs: float) -> tuple[list[Run], tuple[str, ...]]:
    """Recordings less the samples whose torque changes faster than they are taken, and notes of what was left out.

    Only of recordings that are too slow for the comparison's `cutoff_hz`: others show an impact. `errs`: share of an axis's
    torque by which the comparison errs.
    """
    found, notes = [], []
    for run in runs:
        axes = dict(run.axes)
        for name, own in run.axes.items() if run.cutoff_hz < cutoff_hz else ():
            shaken = _shaken(run, own, errs)
            kept = own.counting(~shaken, ~shaken)
            before, after = own.used.sum(), kept.used.sum()
            if ENOUGH * before <= after < before:
                axes[name] = kept
                notes.append(
                    f"{run.recording.name}: the joint of {name} is shaken against its motor faster than it is sampled; "
                    f"{1.0 - after / before:.0%} of the samples do not count."
                )
        found.append(replace(run, axes=axes))
    return found, tuple(notes)


def _shaken(run: Run, own: AxisRun, errs: float) -> Mask:
    """Samples (n,) near which the torque that accelerates the joint against its motor, by its own encoder, changes by more than
    the comparison errs from one sample to the next and back; none without such an encoder.
    """
    columns = run.recording.columns[own.axis]
    shaken = np.zeros(len(own.torque), dtype=np.bool_)
    if JOINT not in columns:
        return shaken
    ahead = columns[JOINT] - measured_position(columns, run.period)
    link = own.motion.inertia - own.motion.rotor_inertia
    torque = link[1:-1] * np.diff(ahead, 2) / run.period**2
    least = errs * float(np.sqrt(np.mean(own.torque**2)))
    shaken[2:-2] = 0.5 * np.abs(np.diff(torque, 2)) > least
    return widen(shaken, reach(run.period, run.cutoff_hz))
