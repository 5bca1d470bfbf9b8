"""From recordings to what causes are compared on: the motion of each axis, its torque, and which samples count."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from drivetwin.diagnosis.prepare.asked_torque import AskedTorque
from drivetwin.diagnosis.prepare.channel import delay_of, step_of, torque_of, unchanged
from drivetwin.diagnosis.prepare.deflection import deflection
from drivetwin.diagnosis.prepare.drive_law import answer_of
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.run import AxisRun, Coupling, Run, stride_of
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.emulator.dynamics import Motion
from drivetwin.emulator.dynamics.sampling import Sampling
from drivetwin.motion.axis_motion import AxisMotion, measured_position, velocity_noise
from drivetwin.motion.filtering import effective_cutoff, fine_derivative, reach, zero_phase
from drivetwin.motion.moving import (
    STANDSTILL_REACH,
    Standstill,
    select,
    shaken,
    standstill,
    standstill_velocities,
    widen,
)
from drivetwin.recording.recording import Recording

NOTHING_ASKED: Mapping[str, AskedTorque] = MappingProxyType({})

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WIDE = 2.5
"""The motion that effects see is filtered this many times wider than what is compared: their torque is filtered once more."""
RIGID_RATE = 3.0
"""The rigid model is evaluated at so many samples a period of the motion's own cut-off, and joined by a cubic spline."""
TURNED = 0.5
"""Of a sample period before and after a reversal, in which friction may have turned round or not."""
HARDLY_COUPLED = 1e-3
"""Of the inertias of two axes, that the one between them must be to count."""
ENOUGH_FITTED = 0.25
"""Of the samples in motion, that must be far from a standstill to be fitted alone; an axis may dwell everywhere."""


def standstill_of(simulation: Simulation, recordings: Sequence[Recording], cutoff_hz: float) -> list[dict[str, Standstill]]:
    """Where each axis counts as standing, recording by recording; everywhere where it never moves.

    Below 0.2 % of its highest speed in all recordings, and five times the noise of this recording's velocity at the cut-off.
    And where it is only shaken.
    """
    pieces = [_narrow(simulation, recording, cutoff_hz) for recording in recordings]
    found: list[dict[str, Standstill]] = [{} for _ in pieces]
    for axis in simulation.axes:
        motions = [piece[axis] for piece in pieces]
        for each, speed in zip(found, standstill_velocities(motions), strict=True):
            each[axis] = standstill(motions, speed)
    return found


def begins(recordings: Sequence[Recording]) -> list[float]:
    """When each recording's time was 0 [s] since the machine was switched on; by the clock, since the first; else 0."""
    clocks = [start.timestamp() for one in recordings if isinstance(start := one.info.start_time, datetime)]
    found = []
    for one in recordings:
        start = one.info.start_time
        found.append(start.timestamp() - min(clocks) if isinstance(start, datetime) else float(start or 0.0))
    return found


def prepare(
    simulation: Simulation,
    recording: Recording,
    cutoff_hz: float,
    motion_hz: float,
    stands: Mapping[str, Standstill],
    began: float,
    reversal: float = 0.0,
    asked: Mapping[str, AskedTorque] = NOTHING_ASKED,
) -> Run:
    """Filter a recording and evaluate the simulation as it stands on its motion.

    `cutoff_hz` is that of the comparison, `motion_hz` up to where the position tells more than noise; `began`: when the
    recording's time was 0 [s] since the machine was switched on; `reversal` [s]: of `Settings`; `asked`: of the axes whose
    torque was not recorded.
    """
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    wide = effective_cutoff(period, min(WIDE * cutoff, motion_hz))
    kinematics = Kinematics.of(recording, simulation.axes, wide)
    compared = Kinematics.of(recording, simulation.axes, min(cutoff, wide))
    rigid = _rigid(simulation, kinematics, max(1, int(1.0 / (RIGID_RATE * wide * period))))
    inertia = _inertia(simulation, kinematics, max(1, int(0.02 / period)))
    weight = _weight(simulation, compared, max(1, int(0.02 / period)))
    slope = _weight_slope(simulation, kinematics, max(1, int(0.02 / period)))
    dynamics, narrow = simulation.dynamics(), _narrow(simulation, recording, min(cutoff, wide))
    axes = {}
    for k, axis in enumerate(simulation.axes):
        motion = Motion(
            position=kinematics.position[:, k].copy(),
            velocity=kinematics.velocity[:, k].copy(),
            acceleration=kinematics.acceleration[:, k].copy(),
            torque=torque_of(recording, axis),
            time=recording.time + began,
            rigid_torque=rigid[:, k].copy(),
            inertia=inertia[:, k, k].copy(),
            rotor_inertia=float(simulation.model.dof_armature[simulation.dof(axis)]),
            from_others=_from_others(inertia[:, k], kinematics.acceleration, k),
            band=cutoff,
            deflection=deflection(recording, axis, measured_position(recording.columns[axis], period), period, cutoff),
            weight_slope=slope[:, k, k].copy(),
            sampling=None if axis in asked else _sampling(recording, axis, inertia[:, k, k], wide),
        )
        chosen = select(narrow[axis], stands[axis], 0.0)
        fitted = chosen.fitted if chosen.fitted.sum() >= ENOUGH_FITTED * chosen.moving.sum() else chosen.moving
        apart = fitted & select(narrow[axis], stands[axis], reversal).fitted if axis in asked else fitted
        used = apart if apart.sum() >= ENOUGH_FITTED * fitted.sum() else fitted
        held = shaken(narrow[axis], stands[axis])
        near = widen(chosen.moving, round(STANDSTILL_REACH * reach(period, cutoff)))
        sticks = near & (held | _sticks(motion, stands[axis].velocity))
        simulated = rigid[:, k] + dynamics[axis].friction.resistance(motion)
        base = zero_phase(np.where(sticks, motion.torque, simulated), period, cutoff)
        torque = zero_phase(motion.torque, period, cutoff)
        recorded = recording.columns[axis]["torque"]
        step = recording.info.axes[axis].torque_resolution or step_of(recorded)
        axes[axis] = AxisRun(
            axis,
            motion,
            torque,
            base,
            weight[:, k].copy(),
            sticks,
            used,
            fitted,
            unchanged(recorded, period),
            step,
            asked.get(axis),
        )
    coupling = _coupling(simulation.axes, inertia, slope)
    return Run(recording, period, cutoff, wide, stride_of(period, cutoff), compared, axes, coupling)


def _sampling(recording: Recording, axis: str, inertia: Array, motion_hz: float) -> Sampling | None:
    """How the torque of an axis of an inertia (n,) was recorded, where loops are told that a drive may have."""
    info = recording.info.axes[axis]
    answer = answer_of(info, inertia)
    if answer is None:
        return None
    middle = float(np.median(inertia))
    found = Sampling(recording.info.sample_period, answer, motion_hz, middle, delay_of(info))
    return found if found.is_likely else None


def _sticks(motion: Motion, threshold: float) -> Mask:
    """Where an axis stands.

    Before and after a rest, and as it reverses: for the milliseconds in which friction turns round, any torque between its two
    levels holds. Within half a sample of a reversal, position and torque of a sample do not tell on which side of it they were
    taken.
    """
    speed, turned = np.abs(motion.velocity), TURNED * motion.period * np.abs(motion.acceleration)
    return np.asarray(speed <= np.maximum(threshold, turned))


def _narrow(simulation: Simulation, recording: Recording, cutoff_hz: float) -> dict[str, AxisMotion]:
    """The motion through the filter of the comparison, by which motion and standstill are distinguished."""
    period = recording.info.sample_period
    cutoff = effective_cutoff(period, cutoff_hz)
    found = {}
    for axis in simulation.axes:
        raw = measured_position(recording.columns[axis], period)
        position = zero_phase(raw, period, cutoff)
        velocity = fine_derivative(position, period, cutoff)
        found[axis] = AxisMotion(
            recording=recording.name,
            axis=axis,
            period=period,
            cutoff_hz=cutoff,
            time=recording.time,
            position=position,
            velocity=velocity,
            acceleration=velocity,
            torque=velocity,
            model_torque=velocity,
            velocity_noise=velocity_noise(recording, axis, raw, position, cutoff),
        )
    return found


def _rigid(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    return between(simulation.torques(kinematics.every(stride)), len(kinematics.position), stride)


def _inertia(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    """d torque / d acceleration along the motion, (n, k, k): of each axis, by each axis."""
    few = kinematics.every(stride)
    rest = np.zeros_like(few.position)
    still = simulation.torques(Kinematics(few.position, rest, rest))
    columns = []
    for k in range(few.position.shape[1]):
        unit = rest.copy()
        unit[:, k] = 1.0
        columns.append(simulation.torques(Kinematics(few.position, rest, unit)) - still)
    whole = [between(column, len(kinematics.position), stride) for column in columns]
    return np.stack(whole, axis=2)


def _weight(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    """What each axis needs to stand where it is, (n, k)."""
    few = kinematics.every(stride)
    rest = np.zeros_like(few.position)
    return between(simulation.torques(Kinematics(few.position, rest, rest)), len(kinematics.position), stride)


def _weight_slope(simulation: Simulation, kinematics: Kinematics, stride: int) -> Array:
    """d weight / d position along the motion, (n, k, k): of each axis, by each axis; by central differences."""
    few = kinematics.every(stride)
    rest = np.zeros_like(few.position)
    columns = [simulation.slopes(Kinematics(few.position, rest, rest), axis) for axis in simulation.axes]
    whole = [between(column, len(kinematics.position), stride) for column in columns]
    return np.stack(whole, axis=2)


def _from_others(inertia: Array, acceleration: Array, k: int) -> Array:
    """Torque (n,) of axis k that the others' accelerations cost; both (n, axes)."""
    return np.asarray(np.einsum("nj,nj->n", inertia, acceleration) - inertia[:, k] * acceleration[:, k])


def _coupling(axes: Sequence[str], inertia: Array, slope: Array) -> dict[tuple[str, str], Coupling]:
    """What each axis feels of another, where its acceleration is felt; both (n, axes, axes)."""
    own = np.abs(np.diagonal(inertia, axis1=1, axis2=2)).max(axis=0)
    found = {}
    for k, of in enumerate(axes):
        for j, on in enumerate(axes):
            if j != k and np.abs(inertia[:, j, k]).max() > HARDLY_COUPLED * np.sqrt(own[j] * own[k]):
                found[of, on] = Coupling(inertia[:, j, k].copy(), slope[:, j, k].copy())
    return found


def between(values: Array, count: int, stride: int) -> Array:
    """Values (m, k) at every stride-th of `count` samples, joined by a cubic spline."""
    if stride == 1 or len(values) < 4:
        return np.repeat(values, stride, axis=0)[:count]
    at = np.arange(len(values)) * float(stride)
    return np.asarray(CubicSpline(at, values)(np.arange(count, dtype=np.float64)))
