"""Positions that a recorded velocity steadies: where differences of the position are noisier than the drive's own velocity.

Noise of a position grows with the square of the frequency in the acceleration, and a regressor with noise makes its coefficient
too small (errors in variables: Fuller, Measurement Error Models, 1987, sec. 1.1): the inertia would be found too light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from drivetwin.diagnosis.prepare.channel import earlier, torque_of
from drivetwin.diagnosis.prepare.simulation import Kinematics, Simulation
from drivetwin.motion.axis_motion import measured_position
from drivetwin.motion.filtering import effective_cutoff, fine_derivative, reach, zero_phase
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

COUNTED_HZ = 1.0
"""Below it a position is as it was counted, above it the integral of the velocity: that drifts."""
SLOW_HZ = 10.0
"""Below it both show the same motion, by which the velocity's delay is told."""
SAME_SCALE = 0.02
"""By which share a velocity differs from the slope of its position at most."""
SAMPLES = 40_000
"""In the middle of a recording, by which the two are compared."""


@dataclass(frozen=True)
class Steadied:
    """Recordings with the steadier position of each axis, and what a reader needs to know of it.

    `by_velocity`: axes whose position was replaced.
    """

    training: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    by_velocity: frozenset[str]
    notes: tuple[str, ...]


def steadied(
    simulation: Simulation, training: Sequence[Recording], validation: Sequence[Recording], cutoff_hz: float, model_error: float
) -> Steadied:
    """Takes the velocity of each axis where noise of the position costs more torque than the comparison errs by, and it less.

    Every recording has to have it, and it has to explain more of the torque in each of `training`: a velocity through a
    low-pass of first order looks free of noise. `model_error`: of `Settings`.
    """
    inertia = simulation.home_inertia()
    recordings, notes = [*training, *validation], {}
    for axis in simulation.axes:
        late = _late(recordings, axis)
        if late is None:
            continue
        replaced = [_with(one, axis, _steadied(one, axis, late)) for one in recordings]
        fitted = list(zip(recordings, replaced, strict=True))[: len(training)]
        noise = np.array([_noise(old, new, axis, cutoff_hz) for old, new in fitted])
        counted, told = inertia[axis] * np.sqrt(noise.mean(axis=0))
        torque = float(np.sqrt(np.mean([_varies(one, axis, cutoff_hz) for one in training])))
        if counted > max(model_error * torque, told) and all(
            _left(simulation, new, axis, cutoff_hz) < _left(simulation, old, axis, cutoff_hz) for old, new in fitted
        ):
            recordings = replaced
            notes[axis] = (
                f"{axis}: above {COUNTED_HZ:g} Hz its motion is read from the recorded velocity: noise of the position makes "
                f"{100.0 * counted / torque:.2g} % of the torque in the acceleration, that of the velocity "
                f"{100.0 * told / torque:.2g} %."
            )
    count = len(training)
    return Steadied(tuple(recordings[:count]), tuple(recordings[count:]), frozenset(notes), tuple(notes.values()))


def _with(recording: Recording, axis: str, position: Array) -> Recording:
    """The recording with another position (n,) of an axis."""
    own = {**recording.columns[axis], "position": position}
    return replace(recording, columns={**recording.columns, axis: own})


def _late(recordings: Sequence[Recording], axis: str) -> float | None:
    """By how much the velocity of an axis is later than its position [s]; None where one of them is of no use.

    By least squares of the velocity on the position's slope and that one's, over all recordings: one alone tells it to half a
    millisecond. A second encoder is compared with the position sample by sample: beside it that stays as it is.
    """
    slopes, velocities = [], []
    for recording in recordings:
        columns, period = recording.columns[axis], recording.info.sample_period
        if not {"position", "velocity"} <= set(columns) or "joint_position" in columns or _derived(recording, axis):
            return None
        slow = effective_cutoff(period, SLOW_HZ)
        slope = fine_derivative(zero_phase(columns["position"], period, slow), period)
        weight = np.sqrt(period)
        slopes.append(weight * np.column_stack((slope, -fine_derivative(slope, period))))
        velocities.append(weight * zero_phase(columns["velocity"], period, slow))
    scale, late = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(velocities), rcond=None)[0]
    return float(late) if abs(scale - 1.0) <= SAME_SCALE else None


def _steadied(recording: Recording, axis: str, late: float) -> Array:
    """The position as counted below 1 Hz, and as the integral of the velocity above it, read `late` [s] earlier; (n,)."""
    columns, period = recording.columns[axis], recording.info.sample_period
    time = period * np.arange(len(columns["velocity"]))
    integral = CubicSpline(time, earlier(columns["velocity"], late, period)).antiderivative()(time)
    counted = effective_cutoff(period, COUNTED_HZ)
    return np.asarray(integral + zero_phase(columns["position"] - integral, period, counted))


def _derived(recording: Recording, axis: str) -> bool:
    return not {f"{axis}.position", f"{axis}.velocity"}.isdisjoint(recording.info.derived)


def _noise(counted: Recording, steadied: Recording, axis: str, cutoff_hz: float) -> tuple[float, float]:
    """Mean square of the noise in the acceleration of both; 0 where a recording is all edges of the filter.

    Two measurements of one quantity, whose noise is independent: what they have in common is the motion (Grubbs, Journal of the
    American Statistical Association 43(242), 1948). A velocity through a filter has less than that: its error counts alike.
    """
    one, other = (_acceleration(recording, axis, cutoff_hz) for recording in (counted, steadied))
    if not one.size:
        return 0.0, 0.0
    common = float(np.mean(one * other))
    return max(float(np.mean(one**2)) - common, 0.0), abs(float(np.mean(other**2)) - common)


def _acceleration(recording: Recording, axis: str, cutoff_hz: float) -> Array:
    """By the position of an axis (n,), in the compared band, without the filter's edges."""
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    slope = fine_derivative(zero_phase(recording.columns[axis]["position"], period, cutoff), period)
    edge = reach(period, cutoff)
    return fine_derivative(slope, period)[edge : len(slope) - edge]


def _varies(recording: Recording, axis: str, cutoff_hz: float) -> float:
    """Variance of an axis's torque in the compared band."""
    period = recording.info.sample_period
    return float(np.var(zero_phase(torque_of(recording, axis), period, effective_cutoff(period, cutoff_hz))))


def _left(simulation: Simulation, recording: Recording, axis: str, cutoff_hz: float) -> float:
    """Energy that inertia, weight, Coulomb and viscous friction leave of an axis's torque [(N·m)² or N²], each by a factor of
    its own; torque and motion may differ a little in time.
    """
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    spare = max(len(recording.time) - SAMPLES, 0) // 2
    part = slice(spare, len(recording.time) - spare)
    raw = [measured_position(recording.columns[one], period)[part] for one in simulation.axes]
    position = np.column_stack([zero_phase(samples, period, cutoff) for samples in raw])
    velocity = np.column_stack([fine_derivative(samples, period) for samples in position.T])
    acceleration = np.column_stack([fine_derivative(samples, period) for samples in velocity.T])
    rest, number = np.zeros_like(position), simulation.axes.index(axis)
    weight = simulation.torques(Kinematics(position, rest, rest))[:, number]
    moves = simulation.torques(Kinematics(position, velocity, acceleration))[:, number] - weight
    speed = velocity[:, number]
    later = [fine_derivative(each, period) for each in (moves, weight)]
    columns = np.column_stack((moves, weight, *later, np.sign(speed), speed, np.ones_like(speed)))
    inside = slice(reach(period, cutoff), len(columns) - reach(period, cutoff))
    torque = zero_phase(torque_of(recording, axis)[part], period, cutoff)[inside]
    scaled = columns[inside] / np.maximum(np.abs(columns[inside]).max(axis=0), np.finfo(float).tiny)
    left = torque - scaled @ np.linalg.lstsq(scaled, torque, rcond=None)[0]
    return float(left @ left)
