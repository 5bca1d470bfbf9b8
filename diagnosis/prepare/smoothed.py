"""Motion read from a position less its noise: where differences of the position are more noise than motion.

Noise in a regressor makes its coefficient too small, and whatever passes less of it fits better: a stiff spring that is not
there. The best linear estimate of the motion from position with white noise has, at each frequency, the share of the power that
is not noise (Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time Series, 1949); regressed on it, a
coefficient is right (Carroll et al., Measurement Error in Nonlinear Models, 2006, ch. 4).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from drivetwin.diagnosis.prepare.cutoff import Sensor
from drivetwin.diagnosis.prepare.rigid_fit import rest_of_rigid_body, tells
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.motion.axis_motion import SMOOTHED
from drivetwin.motion.filtering import effective_cutoff, reach
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

KEPT_HZ = 1.0
"""Below it a position is as it was counted: no noise of an encoder moves an axis so slowly."""
HALF = 0.5
"""Of the power: where less is motion, a reader is told."""
SURE = 0.975
"""Probability with which less torque has to be left: more than that is one case in forty by chance."""
BLOCKS = 20
"""Of a recording, by which that is judged: no shorter than the filter reaches."""


@dataclass(frozen=True)
class Smoothed:
    """Recordings with a smoothed position where that is better, and what a reader needs to know of it."""

    training: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    notes: tuple[str, ...]


def smoothed(
    simulation: Simulation,
    training: Sequence[Recording],
    validation: Sequence[Recording],
    cutoff_hz: float,
    by_velocity: Collection[str],
) -> Smoothed:
    """Gives an axis a smoothed position where differences of it are more noise than motion in the compared band, and where the
    motion read from it leaves less torque unexplained in `training` together, and not by chance: where the axis stands, nothing
    is told.

    Not where it is read from its velocity. The columns as recorded stay: they are what the drive's loops saw.
    """
    recordings, count, notes = [*training, *validation], len(training), []
    for axis in simulation.axes:
        if axis in by_velocity or not all(_is_counted(one, axis) for one in recordings):
            continue
        fitted = [one for one in recordings[:count] if tells(one, cutoff_hz)]
        at = float(np.median([_lowest(one, axis) for one in fitted])) if fitted else cutoff_hz
        if at >= cutoff_hz:
            continue
        if _leaves_less(simulation, fitted, axis, cutoff_hz):
            recordings = [_less_noise(one, axis) for one in recordings]
            notes.append(
                f"{axis}: its position is smoothed, because from {at:.2g} Hz on differences of it are more noise than motion."
            )
    return Smoothed(tuple(recordings[:count]), tuple(recordings[count:]), tuple(notes))


def _leaves_less(simulation: Simulation, recordings: Sequence[Recording], axis: str, cutoff_hz: float) -> bool:
    """Whether a motion less its noise leaves less torque unexplained than the one as counted, by more than chance: the paired
    differences of energy, block by block, by Student's t (Biometrika 6(1), 1908).
    """

    def left(recording: Recording) -> Array:
        torque = rest_of_rigid_body(simulation, recording, axis, cutoff_hz)
        period = recording.info.sample_period
        blocks = max(1, min(BLOCKS, len(torque) // reach(period, effective_cutoff(period, cutoff_hz))))
        return np.array([float(part @ part) for part in np.array_split(torque, blocks)])

    less = np.concatenate([left(one) - left(_less_noise(one, axis)) for one in recordings])
    if len(less) < 2:
        return False
    error = float(np.std(less, ddof=1)) / np.sqrt(len(less))
    return bool(np.mean(less) > stats.t.ppf(SURE, len(less) - 1) * error)


def _is_counted(recording: Recording, axis: str) -> bool:
    """Whether an encoder counted the position, and no second one is compared with it sample by sample."""
    columns = recording.columns[axis]
    return "position" in columns and f"{axis}.position" not in recording.info.derived and "joint_position" not in columns


def _lowest(recording: Recording, axis: str) -> float:
    """Frequency [Hz] from which less than half of the position's power is motion."""
    frequency, share = Sensor.of(recording, axis, velocity=False).share_of_motion()
    above = frequency[(frequency >= KEPT_HZ) & (share < HALF)]
    return float(above.min(initial=0.5 / recording.info.sample_period))


def _less_noise(recording: Recording, axis: str) -> Recording:
    """With the position times the share of motion at each frequency, its ends mirrored for a second."""
    columns, period = recording.columns[axis], recording.info.sample_period
    frequency, share = Sensor.of(recording, axis, velocity=False).share_of_motion()
    position = columns["position"]
    more = min(len(position) - 1, round(1.0 / period))
    if not len(frequency) or more < 1:
        return recording
    ends = 2.0 * position[0] - position[more:0:-1], 2.0 * position[-1] - position[-2 : -more - 2 : -1]
    whole = np.concatenate((ends[0], position, ends[1]))
    line = np.linspace(whole[0], whole[-1], len(whole))
    at = np.fft.rfftfreq(len(whole), period)
    passes = np.where(at < KEPT_HZ, 1.0, np.interp(at, frequency, share))
    found = np.fft.irfft(passes * np.fft.rfft(whole - line), len(whole)) + line
    kept = np.asarray(found[more : more + len(position)])
    return replace(recording, columns={**recording.columns, axis: {**columns, SMOOTHED: kept}})
