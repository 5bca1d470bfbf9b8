"""Recordings without torque: what their drive's loops asked for takes its place, as far as demand and position tell it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from drivetwin.diagnosis.prepare.simulation import Kinematics, Simulation
from drivetwin.motion.filtering import effective_cutoff, fine_derivative, zero_phase
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import TORQUE, DriveLaw, Recording
from drivetwin.twin.asked import asked, loops_by_position
from drivetwin.twin.course import grid_of
from drivetwin.twin.loops import Loops

Array = NDArray[np.float64]

SLOW_HZ = 10.0
"""What loops hold and when they take a rate is told below it: there a log of 30 rows a second says as much as any."""
MOVING = 0.02
"""Share of the top speed from which friction has its sign."""
LEADS = (0.0, 0.5, 1.0)
"""Of the demand's rate before its backward difference, in servo periods: of the last one, of the moment, of the next."""
OFF_BY = 3.0
"""Standard deviations by which friction and inertia of the model may be off where such a lead is chosen."""


@dataclass(frozen=True)
class AskedTorque:
    """How the torque of an axis is known that was not recorded.

    `told_by`: whose loops asked for it. `floats`: but for a constant in each recording, which the loops' integral held as it
    began. `scale_told`: their gains are the recording's, and not what a model takes for them.
    """

    told_by: str
    floats: bool
    scale_told: bool


@dataclass(frozen=True)
class Completed:
    """Recordings with a torque on every axis, and by axis how it is known where it was not recorded."""

    training: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    asked: Mapping[str, AskedTorque]


def completed(
    model: Path, simulation: Simulation, training: Sequence[Recording], validation: Sequence[Recording], spread: float
) -> Completed:
    """Torque that is missing is what the loops asked for, its constant such that the model's friction and weight leave no mean.

    It is listed in `derived`. When the loops take the demand's rate is chosen on `training`, where the recordings do not tell
    it. `spread`: standard deviation of a nominal parameter, as a share. Raises UserError where no loops are known that follow
    the demand.
    """
    compiled = read_mjcf(model)
    laws: dict[str, Loops] = {}
    for recording in (*training, *validation):
        for axis in _without_torque(recording):
            laws.setdefault(axis, loops_by_position(recording, axis, compiled))
    if not laws:
        return Completed(tuple(training), tuple(validation), {})
    slow = [_Slow.of(simulation, recording) for recording in training]
    led = {axis: _led(simulation, slow, axis, law, OFF_BY * spread) for axis, law in laws.items()}
    how = {axis: _how((*training, *validation), axis, law) for axis, law in laws.items()}
    fitted = tuple(_completed(simulation, one, led) for one in slow)
    held = tuple(_completed(simulation, _Slow.of(simulation, recording), led) for recording in validation)
    return Completed(fitted, held, how)


def notes(asked: Mapping[str, AskedTorque]) -> tuple[str, ...]:
    """What a reader needs to know of the torque."""
    return tuple(
        f"{axis}: no torque was recorded. What is compared is the torque that the {how.told_by} asked for, from demand and "
        f"position{', but for a constant in each recording' if how.floats else ''}."
        for axis, how in asked.items()
    )


def _without_torque(recording: Recording) -> list[str]:
    return [axis for axis, columns in recording.columns.items() if TORQUE not in columns]


def _how(recordings: Iterable[Recording], axis: str, loops: Loops) -> AskedTorque:
    drives = [one.info.axes[axis].drive for one in recordings]
    told = all(drive is not None and drive.law is not DriveLaw.UNKNOWN for drive in drives)
    return AskedTorque(loops.told_by, loops.integrates, told)


@dataclass(frozen=True)
class _Slow:
    """The slow motion of a recording and the rigid model's torque for it, each (m, k)."""

    recording: Recording
    kinematics: Kinematics
    rigid: Array

    @classmethod
    def of(cls, simulation: Simulation, recording: Recording) -> _Slow:
        period = recording.info.sample_period
        cutoff = effective_cutoff(period, SLOW_HZ)
        raw = [recording.columns[axis]["position"] for axis in simulation.axes]
        position = np.column_stack([zero_phase(samples, period, cutoff) for samples in raw])
        velocity = np.column_stack([fine_derivative(samples, period) for samples in position.T])
        acceleration = np.column_stack([fine_derivative(samples, period) for samples in velocity.T])
        kinematics = Kinematics(position, velocity, acceleration).every(_every(recording))
        return cls(recording, kinematics, simulation.torques(kinematics))

    def filtered(self, torque: Array) -> Array:
        """A torque (n,) of the recording as slow (m,)."""
        period = self.recording.info.sample_period
        return zero_phase(torque, period, effective_cutoff(period, SLOW_HZ))[:: _every(self.recording)]

    def moving(self, k: int) -> NDArray[np.bool_]:
        """Where the k-th axis moves; everywhere where it never does."""
        speed = np.abs(self.kinematics.velocity[:, k])
        return np.asarray((speed > MOVING * speed.max(initial=0.0)) | (speed.max(initial=0.0) == 0.0))


def _every(recording: Recording) -> int:
    return max(1, int(1.0 / (8.0 * SLOW_HZ * recording.info.sample_period)))


def _led(simulation: Simulation, slow: Sequence[_Slow], axis: str, law: Loops, most: float) -> Loops:
    """The loops with the lead of the demand's rate with which the model leaves least, friction and inertia off by `most`."""
    drives = [one.recording.info.axes[axis].drive for one in slow]
    told = any(drive is not None and drive.velocity_feedforward_lead is not None for drive in drives)
    if told or law.velocity_feedforward == 0.0 or law.velocity_gain == 0.0:
        return law
    period = float(np.median([grid_of(one.recording).period for one in slow]))
    tried = [replace(law, feedforward_lead=share * period) for share in LEADS]
    left = [_left(simulation, slow, axis, loops, most) for loops in tried]
    return tried[int(np.argmin(left))]


def _left(simulation: Simulation, slow: Sequence[_Slow], axis: str, loops: Loops, most: float) -> float:
    """Energy that the model leaves of the asked torque, its friction and inertia off by a share up to `most`."""
    k, inertia = simulation.axes.index(axis), simulation.home_inertia()[axis]
    friction = simulation.dynamics()[axis].friction
    rows, columns = [], []
    for one in slow:
        if TORQUE in one.recording.columns[axis]:
            continue
        moving, velocity = one.moving(k), one.kinematics.velocity[:, k]
        own = np.column_stack(
            [friction.coulomb * np.sign(velocity), friction.viscous * velocity, inertia * one.kinematics.acceleration[:, k]]
        )
        left = one.filtered(asked(one.recording, axis, loops)) - one.rigid[:, k] - own[:, 0] - own[:, 1]
        level = float(loops.integrates)
        rows.append(left[moving] - level * np.mean(left[moving]))
        columns.append(own[moving] - level * np.mean(own[moving], axis=0))
    if not rows:
        return 0.0
    solved = lsq_linear(np.vstack(columns), np.concatenate(rows), bounds=(-most, most), method="bvls")
    return float(2.0 * solved.cost)


def _completed(simulation: Simulation, slow: _Slow, laws: Mapping[str, Loops]) -> Recording:
    """A recording with the torque that is missing, and with the lead by which it was found."""
    recording = slow.recording
    columns, axes = dict(recording.columns), dict(recording.info.axes)
    for axis in _without_torque(recording):
        law = laws[axis]
        torque = asked(recording, axis, law)
        level = _level(simulation, slow, axis, torque) if law.integrates else 0.0
        columns[axis] = {**columns[axis], TORQUE: torque - level}
        drive = axes[axis].drive
        if drive is not None:
            led = drive.model_copy(update={"velocity_feedforward_lead": law.feedforward_lead})
            axes[axis] = axes[axis].model_copy(update={"drive": led})
    derived = [*recording.info.derived, *(f"{axis}.{TORQUE}" for axis in _without_torque(recording))]
    info = recording.info.model_copy(update={"derived": derived, "axes": axes})
    return replace(recording, columns=columns, info=info)


def _level(simulation: Simulation, slow: _Slow, axis: str, torque: Array) -> float:
    """Mean of the torque that rigid model and friction leave while the axis moves [N·m or N]."""
    k, friction = simulation.axes.index(axis), simulation.dynamics()[axis].friction
    velocity, moving = slow.kinematics.velocity[:, k], slow.moving(k)
    left = slow.filtered(torque) - slow.rigid[:, k] - friction.coulomb * np.sign(velocity) - friction.viscous * velocity
    return float(np.mean(left[moving]))
