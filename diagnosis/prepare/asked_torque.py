"""Recordings without torque: what their drive's loops asked for takes its place, as far as demand and position tell it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.filtering import effective_cutoff, zero_phase
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
LEADS = {0.0: 0.25, 0.5: 0.5, 1.0: 0.25}
"""Of the demand's rate before its backward difference, in servo periods: of the last one, of the moment, of the next; and how
probable each is beforehand."""
BLOCK = 1.0
"""Of what the model leaves, in which neighbours tell the same [s]."""
ROUNDS = 30
"""Of the least squares by which it is chosen."""


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
    model: Path, simulation: Simulation, training: Sequence[Recording], validation: Sequence[Recording], settings: Settings
) -> Completed:
    """Torque that is missing is what the loops asked for, its constant such that the model's friction and weight leave no mean.

    It is listed in `derived`. When the loops take the demand's rate is chosen on `training`, where the recordings do not tell
    it. Raises UserError where no loops are known that follow the demand.
    """
    every = (*training, *validation)
    if not any(_without_torque(recording) for recording in every):
        return Completed(tuple(training), tuple(validation), {})
    compiled = read_mjcf(model)
    slow = [_Slow.of(simulation, recording, compiled) for recording in every]
    fitted = slow[: len(training)]
    axes = dict.fromkeys(axis for one in slow for axis in one.laws)
    leads = {axis: _lead(simulation, [one for one in fitted if axis in one.laws], axis, settings) for axis in axes}
    how = {axis: _how([one for one in slow if axis in one.laws], axis) for axis in axes}
    led = [one.led(leads) for one in slow]
    done = [_completed(simulation, one) for one in led]
    return Completed(tuple(done[: len(training)]), tuple(done[len(training) :]), how)


def notes(asked: Mapping[str, AskedTorque]) -> tuple[str, ...]:
    """What a reader needs to know of the torque."""
    return tuple(
        f"{axis}: no torque was recorded. The comparison uses the torque that the {how.told_by} demanded, from demand and "
        f"position{', but for a constant in each recording' if how.floats else ''}."
        for axis, how in asked.items()
    )


def _without_torque(recording: Recording) -> list[str]:
    return [axis for axis, columns in recording.columns.items() if TORQUE not in columns]


@dataclass(frozen=True)
class _Slow:
    """The slow motion of a recording and the rigid model's torque for it, each (m, k); `laws` of the axes without torque."""

    recording: Recording
    kinematics: Kinematics
    rigid: Array
    laws: Mapping[str, Loops]

    @classmethod
    def of(cls, simulation: Simulation, recording: Recording, model: mujoco.MjModel) -> _Slow:
        laws = {axis: loops_by_position(recording, axis, model) for axis in _without_torque(recording)}
        period = recording.info.sample_period
        cutoff = effective_cutoff(period, SLOW_HZ)
        kinematics = Kinematics.of(recording, simulation.axes, cutoff).every(_every(recording))
        return cls(recording, kinematics, simulation.torques(kinematics), laws)

    def led(self, leads: Mapping[str, float]) -> _Slow:
        """With the demand's rate as early, where the recording does not say how early it is."""
        return replace(self, laws={axis: self.law(axis, leads[axis]) for axis in self.laws})

    def law(self, axis: str, lead: float) -> Loops:
        """The loops of an axis, their demand's rate by `lead` early [s] unless the recording tells it."""
        drive = self.recording.info.axes[axis].drive
        told = drive is not None and drive.velocity_feedforward_lead is not None
        return self.laws[axis] if told else replace(self.laws[axis], feedforward_lead=lead)

    def filtered(self, torque: Array) -> Array:
        """A torque (n,) of the recording as slow (m,)."""
        period = self.recording.info.sample_period
        return zero_phase(torque, period, effective_cutoff(period, SLOW_HZ))[:: _every(self.recording)]

    @property
    def period(self) -> float:
        """Of its rows [s]."""
        return _every(self.recording) * self.recording.info.sample_period

    def moving(self, k: int) -> NDArray[np.bool_]:
        """Where the k-th axis moves; everywhere where it never does."""
        speed = np.abs(self.kinematics.velocity[:, k])
        return np.asarray((speed > MOVING * speed.max(initial=0.0)) | (speed.max(initial=0.0) == 0.0))


def _every(recording: Recording) -> int:
    return max(1, int(1.0 / (8.0 * SLOW_HZ * recording.info.sample_period)))


def _how(slow: Sequence[_Slow], axis: str) -> AskedTorque:
    drives = [one.recording.info.axes[axis].drive for one in slow]
    told = all(drive is not None and drive.law is not DriveLaw.UNKNOWN for drive in drives)
    return AskedTorque(slow[0].laws[axis].told_by, any(one.laws[axis].integrates for one in slow), told)


def _lead(simulation: Simulation, slow: Sequence[_Slow], axis: str, settings: Settings) -> float:
    """The most probable lead of the demand's rate [s], friction and inertia of the model off as they usually are.

    Hardly anything else tells it: half a servo period is some per cent of inertia, by a cascade's integral of viscous friction.
    """
    if not any(one.laws[axis].velocity_feedforward * one.laws[axis].velocity_gain for one in slow):
        return 0.0
    period = float(np.median([grid_of(one.recording).period for one in slow]))
    worth = {share: _worth(simulation, slow, axis, share * period, settings) + log(prior) for share, prior in LEADS.items()}
    return period * max(worth, key=worth.__getitem__)


def _worth(simulation: Simulation, slow: Sequence[_Slow], axis: str, lead: float, settings: Settings) -> float:
    """Log density [nats] of what the model leaves of the asked torque, in independent values, and of its parameters."""
    k, inertia = simulation.axes.index(axis), simulation.home_inertia()[axis]
    friction = simulation.dynamics()[axis].friction
    rows, columns, seconds = [], [], 0.0
    for one in slow:
        loops, moving, velocity = one.law(axis, lead), one.moving(k), one.kinematics.velocity[:, k]
        own = np.column_stack(
            [friction.coulomb * np.sign(velocity), friction.viscous * velocity, inertia * one.kinematics.acceleration[:, k]]
        )
        left = one.filtered(asked(one.recording, axis, loops)) - one.rigid[:, k] - own[:, 0] - own[:, 1]
        level = float(loops.integrates)
        rows.append(left[moving] - level * np.mean(left[moving]))
        columns.append(own[moving] - level * np.mean(own[moving], axis=0))
        seconds += np.count_nonzero(moving) * one.period
    return _likeliest(np.vstack(columns), np.concatenate(rows), seconds / BLOCK, settings)


def _likeliest(columns: Array, rows: Array, independent: float, settings: Settings) -> float:
    """Log density [nats] of rows (m,) that hold so many independent values, with shares (p,) of columns (m, p) where it is
    highest; the shares by the t distribution of nominal parameters, by reweighted least squares (Lange, Little and Taylor,
    Journal of the American Statistical Association 84(408), 1989).
    """
    freedom, variance = settings.nominal_freedom, settings.nominal_spread**2
    products, wanted = columns.T @ columns, columns.T @ rows
    shares: Array = np.zeros_like(wanted)
    left = 0.0
    for _ in range(ROUNDS):
        left = max(float(np.sum((rows - columns @ shares) ** 2)), np.finfo(float).tiny)
        weights = np.diag((freedom + 1.0) / (freedom * variance + shares**2))
        shares = np.asarray(np.linalg.solve(independent / left * products + weights, independent / left * wanted))
    far = np.log1p(shares**2 / (freedom * variance))
    return -0.5 * independent * log(left) - 0.5 * (freedom + 1.0) * float(far.sum())


def _completed(simulation: Simulation, slow: _Slow) -> Recording:
    """A recording with the torque that is missing, and with the lead by which it was found."""
    recording = slow.recording
    columns, axes = dict(recording.columns), dict(recording.info.axes)
    for axis, law in slow.laws.items():
        torque = asked(recording, axis, law)
        level = _level(simulation, slow, axis, torque) if law.integrates else 0.0
        columns[axis] = {**columns[axis], TORQUE: torque - level}
        told: dict[str, Any] = {"torque_resolution": _resolution(recording, axis, law, torque)}
        drive = axes[axis].drive
        if drive is not None:
            told["drive"] = drive.model_copy(update={"velocity_feedforward_lead": law.feedforward_lead})
        axes[axis] = axes[axis].model_copy(update=told)
    derived = [*recording.info.derived, *(f"{axis}.{TORQUE}" for axis in slow.laws)]
    info = recording.info.model_copy(update={"derived": derived, "axes": axes})
    return replace(recording, columns=columns, info=info)


def _resolution(recording: Recording, axis: str, law: Loops, torque: Array) -> float | None:
    """Steps of a recorded torque that would be as noisy as what the loops make of the position's [N·m or N]; None where those
    are not told.

    By what they ask for at positions that differ by chance within a step.
    """
    step = recording.info.axes[axis].position_resolution
    if not step or "position" not in recording.columns[axis]:
        return None
    chance = np.random.default_rng(0).uniform(-0.5, 0.5, len(torque)) * step
    own = {**recording.columns[axis], "position": recording.columns[axis]["position"] + chance}
    dithered = asked(replace(recording, columns={**recording.columns, axis: own}), axis, law)
    return float(np.sqrt(12.0) * np.std(dithered - torque))


def _level(simulation: Simulation, slow: _Slow, axis: str, torque: Array) -> float:
    """Mean of the torque that rigid model and friction leave while the axis moves [N·m or N]."""
    k, friction = simulation.axes.index(axis), simulation.dynamics()[axis].friction
    velocity, moving = slow.kinematics.velocity[:, k], slow.moving(k)
    left = slow.filtered(torque) - slow.rigid[:, k] - friction.coulomb * np.sign(velocity) - friction.viscous * velocity
    return float(np.mean(left[moving]))
