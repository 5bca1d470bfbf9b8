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
from drivetwin.diagnosis.settings import LEAST_OFF, Settings
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
"""Leads of the demand's rate that are tried, in servo periods, with their prior probability: its backward difference, the rate
of the moment, that of the next period."""
BLOCK = 1.0
"""Length of motion that counts as one independent value [s]."""
ROUNDS = 30
"""Iterations of the reweighted least squares."""
TINY = 1e-12
"""Torque or share of an energy that is none."""


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
    leads = {axis: _lead(simulation, _with_loops(fitted, axis) or _with_loops(slow, axis), axis, settings) for axis in axes}
    how = {axis: _how(_with_loops(slow, axis), axis) for axis in axes}
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


def _with_loops(slow: Sequence[_Slow], axis: str) -> list[_Slow]:
    """Those that lack the torque of an axis."""
    return [one for one in slow if axis in one.laws]


def _every(recording: Recording) -> int:
    return max(1, int(1.0 / (8.0 * SLOW_HZ * recording.info.sample_period)))


def _how(slow: Sequence[_Slow], axis: str) -> AskedTorque:
    drives = [one.recording.info.axes[axis].drive for one in slow]
    told = all(drive is not None and drive.law is not DriveLaw.UNKNOWN for drive in drives)
    return AskedTorque(slow[0].laws[axis].told_by, any(one.laws[axis].integrates for one in slow), told)


def _lead(simulation: Simulation, slow: Sequence[_Slow], axis: str, settings: Settings) -> float:
    """The most probable lead of the demand's rate [s], friction and inertia of the model off as they usually are.

    Little else distinguishes the leads: half a servo period looks like some per cent of inertia, and through a cascade's
    integral also like viscous friction.
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
    values = np.array([friction.coulomb, friction.viscous, inertia])
    asked_for, rows, columns, seconds = [], [], [], 0.0
    for one in slow:
        loops, moving, velocity = one.law(axis, lead), one.moving(k), one.kinematics.velocity[:, k]
        own = np.column_stack([np.sign(velocity), velocity, one.kinematics.acceleration[:, k]])
        torque = one.filtered(asked(one.recording, axis, loops))
        left = torque - one.rigid[:, k] - own[:, :2] @ values[:2]
        level = float(loops.integrates)
        asked_for.append(torque[moving] - level * np.mean(torque[moving]))
        rows.append(left[moving] - level * np.mean(left[moving]))
        columns.append(own[moving] - level * np.mean(own[moving], axis=0))
        seconds += np.count_nonzero(moving) * one.period
    whole = np.vstack(columns)
    costs = _rms(np.concatenate(asked_for)) / np.maximum(np.sqrt(np.mean(whole**2, axis=0)), TINY)
    spreads = np.hypot(settings.nominal_spread * values, LEAST_OFF * costs)
    return likeliest(whole * spreads, np.concatenate(rows), seconds / BLOCK, settings.nominal_freedom)


def likeliest(columns: Array, rows: Array, independent: float, freedom: float) -> float:
    """The highest log density [nats] of rows (m,) that hold so many independent values, less some times columns (m, p).

    The times have t distributions of scale 1; by reweighted least squares (Lange, Little and Taylor, Journal of the American
    Statistical Association 84(408), 1989). From where the prior has them and from where the rows have them: either may be the
    better of two maxima.
    """
    floor = max(TINY, TINY * float(np.sum(rows**2)))
    begun = (np.zeros(columns.shape[1]), np.linalg.lstsq(columns, rows, rcond=None)[0])
    return max(_climbed(np.asarray(times), columns, rows, independent, freedom, floor) for times in begun)


def _climbed(times: Array, columns: Array, rows: Array, independent: float, freedom: float, floor: float) -> float:
    """The nearest maximum of that, where at least an energy `floor` is left."""
    products, wanted = columns.T @ columns, columns.T @ rows

    def left() -> float:
        return max(float(np.sum((rows - columns @ times) ** 2)), floor)

    for _ in range(ROUNDS):
        weights, share = np.diag((freedom + 1.0) / (freedom + times**2)), independent / left()
        times = np.asarray(np.linalg.solve(share * products + weights, share * wanted))
    return -0.5 * independent * log(left()) - 0.5 * (freedom + 1.0) * float(np.sum(np.log1p(times**2 / freedom)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


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
