"""Recordings without torque: what their drive's loops asked for takes its place, as far as demand and position tell it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.lead import lead_of
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.diagnosis.prepare.slow_motion import SlowMotion, without_torque
from drivetwin.diagnosis.settings import Settings
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import TORQUE, DriveLaw, Recording
from drivetwin.twin.asked import asked
from drivetwin.twin.loops import Loops

Array = NDArray[np.float64]


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

    It is listed in `derived`. When the loops take the demand's rate is chosen on `training`, or on `validation` where only that
    lacks the torque, unless the recordings tell it. Raises UserError where no loops are known that follow the demand.
    """
    every = (*training, *validation)
    if not any(without_torque(recording) for recording in every):
        return Completed(tuple(training), tuple(validation), {})
    compiled = read_mjcf(model)
    slow = [SlowMotion.of(simulation, recording, compiled) for recording in every]
    fitted = slow[: len(training)]
    axes = dict.fromkeys(axis for one in slow for axis in one.laws)
    leads = {axis: lead_of(simulation, _with_loops(fitted, axis) or _with_loops(slow, axis), axis, settings) for axis in axes}
    how = {axis: _how(_with_loops(slow, axis), axis) for axis in axes}
    led = [one.led(leads) for one in slow]
    done = [_completed(simulation, one) for one in led]
    return Completed(tuple(done[: len(training)]), tuple(done[len(training) :]), how)


def levelled(simulation: Simulation, recordings: Sequence[Recording], floating: Collection[str]) -> list[Recording]:
    """Recordings whose relative position has been placed, the constant of a torque that loops asked for as it is there."""
    placed = [[axis for axis in floating if one.info.axes[axis].position_relative] for one in recordings]
    return [_levelled(simulation, one, axes) for one, axes in zip(recordings, placed, strict=True)]


def _levelled(simulation: Simulation, recording: Recording, axes: Sequence[str]) -> Recording:
    if not axes:
        return recording
    slow, columns = SlowMotion.of(simulation, recording, simulation.model), dict(recording.columns)
    for axis in axes:
        torque = columns[axis][TORQUE]
        columns[axis] = {**columns[axis], TORQUE: torque - _level(simulation, slow, axis, torque)}
    return replace(recording, columns=columns)


def notes(asked: Mapping[str, AskedTorque]) -> tuple[str, ...]:
    """What a reader needs to know of the torque."""
    return tuple(
        f"{axis}: no torque was recorded. The comparison uses the torque that the {how.told_by} demanded, from demand and "
        f"position{', but for a constant in each recording' if how.floats else ''}."
        for axis, how in asked.items()
    )


def _with_loops(slow: Sequence[SlowMotion], axis: str) -> list[SlowMotion]:
    """Those that lack the torque of an axis."""
    return [one for one in slow if axis in one.laws]


def _how(slow: Sequence[SlowMotion], axis: str) -> AskedTorque:
    drives = [one.recording.info.axes[axis].drive for one in slow]
    told = all(drive is not None and drive.law is not DriveLaw.UNKNOWN for drive in drives)
    return AskedTorque(slow[0].laws[axis].told_by, any(one.laws[axis].integrates for one in slow), told)


def _completed(simulation: Simulation, slow: SlowMotion) -> Recording:
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


def _level(simulation: Simulation, slow: SlowMotion, axis: str, torque: Array) -> float:
    """Mean of the torque that rigid model and friction leave while the axis moves [N·m or N]."""
    k, friction = simulation.axes.index(axis), simulation.dynamics()[axis].friction
    velocity, moving = slow.kinematics.velocity[:, k], slow.moving(k)
    left = slow.filtered(torque) - slow.rigid[:, k] - friction.coulomb * np.sign(velocity) - friction.viscous * velocity
    return float(np.mean(left[moving]))
