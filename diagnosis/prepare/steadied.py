"""Motion that is read from a recorded velocity: where differences of the position are noisier than the drive's own velocity.

Noise of a position grows with the square of the frequency in the acceleration, and a regressor with noise makes its coefficient
too small (errors in variables: Fuller, Measurement Error Models, 1987, sec. 1.1): the inertia would be found too light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from drivetwin.diagnosis.prepare.channel import torque_of
from drivetwin.diagnosis.prepare.rigid_fit import REACHES, left_by_rigid_body, tells
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.foundation.quantities import number
from drivetwin.motion.axis_motion import STEADIED, measured_position
from drivetwin.motion.earlier import earlier
from drivetwin.motion.filtering import effective_cutoff, fine_derivative, reach, zero_phase
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

COUNTED_HZ = 1.0
"""Below it a position is as it was counted, above it as the integral of the velocity, which drifts."""
SLOW_HZ = 10.0
"""Below it both show the same motion, by which the scale and the delay of the velocity are found."""
SAME_SCALE = 0.02
"""By which share a velocity differs from the slope of its position at most."""


@dataclass(frozen=True)
class Steadied:
    """Recordings with a steadied position where that is better, `by_velocity`, and what a reader needs to know of it."""

    training: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    by_velocity: frozenset[str]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Velocity:
    """How the recorded velocity of an axis differs from the slope of its position: by a factor, and in time [s]."""

    scale: float
    late: float


def steadied(
    simulation: Simulation, training: Sequence[Recording], validation: Sequence[Recording], cutoff_hz: float, model_error: float
) -> Steadied:
    """Gives an axis a steadied position where noise of the counted one costs more torque than the model error, and noise of the
    velocity costs less.

    Every recording has to have the velocity, and the motion read from it has to leave less torque unexplained in each of
    `training`: a velocity through a low-pass of first order looks free of noise. `model_error`: of `Settings`. The columns as
    recorded stay: they are what the drive's loops saw.
    """
    inertia = simulation.home_inertia()
    recordings, count = [*training, *validation], len(training)
    notes: dict[str, str] = {}
    for axis in simulation.axes:
        told = _velocities(recordings, axis, cutoff_hz)
        if told is None:
            continue
        blended = [_blended(one, axis, told.get(one.info.sample_period)) for one in recordings]
        fitted = [pair for pair in zip(recordings[:count], blended[:count], strict=True) if tells(pair[0], cutoff_hz)]
        if not fitted:
            continue
        squares = np.array([_noise(old, new, axis, cutoff_hz) for old, new in fitted])
        of_position, of_velocity = inertia[axis] * np.sqrt(squares.mean(axis=0))
        torque = float(np.sqrt(np.mean([_varies(one, axis, cutoff_hz) for one, _ in fitted])))
        if of_position > max(model_error * torque, of_velocity) and all(
            left_by_rigid_body(simulation, new, axis, cutoff_hz) < left_by_rigid_body(simulation, old, axis, cutoff_hz)
            for old, new in fitted
        ):
            recordings = blended
            notes[axis] = (
                f"{axis}: above {COUNTED_HZ:g} Hz its motion is read from the recorded velocity: noise of the position makes "
                f"{number(100.0 * of_position / torque, 2)} % of the torque in the acceleration, that of the velocity "
                f"{number(100.0 * of_velocity / torque, 2)} %."
            )
    return Steadied(tuple(recordings[:count]), tuple(recordings[count:]), frozenset(notes), tuple(notes.values()))


def _velocities(recordings: Sequence[Recording], axis: str, cutoff_hz: float) -> dict[float, _Velocity] | None:
    """By sample period, how the velocity of an axis differs from its position; None where one of them is of no use.

    By least squares over all recordings of a period: one alone tells the delay to half a millisecond, and a velocity that is a
    difference of positions is half a period late. A second encoder is compared with the position sample by sample: beside it
    that stays as it is.
    """
    if not all(_has_both(one, axis) for one in recordings):
        return None
    found = {}
    for period in {one.info.sample_period for one in recordings if tells(one, cutoff_hz)}:
        own = [one for one in recordings if one.info.sample_period == period and tells(one, cutoff_hz)]
        slow = effective_cutoff(period, SLOW_HZ)
        slopes = [fine_derivative(zero_phase(one.columns[axis]["position"], period, slow), period, slow) for one in own]
        measured = [zero_phase(one.columns[axis]["velocity"], period, slow) for one in own]
        columns = np.concatenate([np.column_stack((slope, -fine_derivative(slope, period, slow))) for slope in slopes])
        scale, late = np.linalg.lstsq(columns, np.concatenate(measured), rcond=None)[0]
        if abs(scale - 1.0) > SAME_SCALE:
            return None
        found[period] = _Velocity(float(scale), float(late / scale))
    return found


def _has_both(recording: Recording, axis: str) -> bool:
    columns, derived = recording.columns[axis], recording.info.derived
    recorded = {"position", "velocity"} <= set(columns) and {f"{axis}.position", f"{axis}.velocity"}.isdisjoint(derived)
    return recorded and "joint_position" not in columns


def _blended(recording: Recording, axis: str, velocity: _Velocity | None) -> Recording:
    """With the position as counted below 1 Hz, and as the integral of the velocity above it; as it is where nothing is told."""
    if velocity is None or len(recording.time) < REACHES:
        return recording
    columns, period = recording.columns[axis], recording.info.sample_period
    time = period * np.arange(len(columns["velocity"]))
    true = earlier(columns["velocity"] / velocity.scale, velocity.late, period)
    integral = CubicSpline(time, true).antiderivative()(time)
    counted = zero_phase(columns["position"] - integral, period, effective_cutoff(period, COUNTED_HZ))
    return replace(recording, columns={**recording.columns, axis: {**columns, STEADIED: np.asarray(integral + counted)}})


def _noise(counted: Recording, blended: Recording, axis: str, cutoff_hz: float) -> tuple[float, float]:
    """Mean square of the noise in the acceleration of both.

    Two measurements of one quantity, whose noise is independent: what they have in common is the motion (Grubbs, Journal of the
    American Statistical Association 43(242), 1948). The acceleration of a low-passed velocity has less power than that: the
    difference is its error.
    """
    one, other = (_acceleration(recording, axis, cutoff_hz) for recording in (counted, blended))
    common = float(np.mean(one * other))
    return max(float(np.mean(one**2)) - common, 0.0), abs(float(np.mean(other**2)) - common)


def _acceleration(recording: Recording, axis: str, cutoff_hz: float) -> Array:
    """Of an axis (n,), in the compared band, without the filter's edges."""
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    slope = fine_derivative(zero_phase(measured_position(recording.columns[axis], period), period, cutoff), period, cutoff)
    edge = reach(period, cutoff)
    return fine_derivative(slope, period, cutoff)[edge:-edge]


def _varies(recording: Recording, axis: str, cutoff_hz: float) -> float:
    """Variance of an axis's torque in the compared band."""
    period = recording.info.sample_period
    return float(np.var(zero_phase(torque_of(recording, axis), period, effective_cutoff(period, cutoff_hz))))
