"""Recordings whose position has a zero of its own: left aside where others are enough, else placed by the model's torque."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from drivetwin.diagnosis.prepare.channel import torque_of
from drivetwin.diagnosis.prepare.kinematics import Kinematics
from drivetwin.diagnosis.prepare.rates import ENOUGH, seconds
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.motion.axis_motion import SMOOTHED, STEADIED
from drivetwin.motion.filtering import effective_cutoff, zero_phase
from drivetwin.recording.recording import Recording

Array = NDArray[np.float64]

PLACED = ("position", "position_demand", STEADIED, SMOOTHED)
"""Columns that have the joint's zero."""
PLACES = 24
"""Zeros that are tried over an axis's range, before the best is moved."""
SAMPLES = 1500
"""Of a recording, on which a zero is found."""
SLOW_HZ = 10.0
"""Weight and inertia are told below it."""
DEPENDS = 0.01
"""Share of the torque by which the model's torque must change with a position for its zero to matter."""
MOVED = 1e-4
"""Relative difference of a zero for slopes."""


@dataclass(frozen=True)
class Placed:
    """Recordings in the model's coordinates as far as that can be told, and what a reader needs to know of it.

    `zeros`: by recording, by how much relative axes were moved [rad or m]; `adrift`: those whose zero the model's torque does
    not tell. `aside`: relative recordings as they are, where the absolute ones are enough.
    """

    recordings: tuple[Recording, ...]
    notes: tuple[str, ...] = ()
    zeros: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    adrift: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    aside: tuple[Recording, ...] = ()


def positions(
    simulation: Simulation,
    recordings: Sequence[Recording],
    cutoff_hz: float,
    floating: Collection[str] = (),
    enough: float = ENOUGH,
) -> Placed:
    """Leaves relative recordings aside, or moves each relative axis to where the model needs the measured torque.

    `floating`: axes whose torque is known but for a constant in each recording. `enough`: share of the recorded time from which
    the absolute recordings are enough.
    """
    absolute = [recording for recording in recordings if not relative_axes(recording)]
    if seconds(absolute) >= enough * seconds(recordings):
        return Placed(tuple(absolute), aside=tuple(one for one in recordings if relative_axes(one)))
    return by_the_model(simulation, recordings, cutoff_hz, floating)


def by_the_model(
    simulation: Simulation, recordings: Sequence[Recording], cutoff_hz: float, floating: Collection[str] = ()
) -> Placed:
    """Each relative axis, moved to where the model needs the measured torque."""
    placed, notes, zeros, adrift = [], [], {}, {}
    for recording in recordings:
        relative = relative_axes(recording)
        found = zeros_of(simulation, recording, relative, cutoff_hz, floating) if relative else {}
        placed.append(moved(recording, found) if found else recording)
        zeros[recording.name] = found
        adrift[recording.name] = tuple(axis for axis in relative if axis not in found)
        unit = {axis: "m" if simulation.slides(axis) else "rad" for axis in found}
        if found:
            told = ", ".join(f"{axis} {value:+.3g} {unit[axis]}" for axis, value in found.items())
            notes.append(f"{recording.name}: the position is relative; by the model's torque its zero is at {told}.")
    return Placed(tuple(placed), tuple(notes), zeros, adrift)


def left_out(placed: Placed) -> tuple[str, ...]:
    """A note of the recordings that are left aside, where they stay so."""
    if not placed.aside:
        return ()
    aside, used = (", ".join(one.name for one in part) for part in (placed.aside, placed.recordings))
    return (f"{aside}: left out, for the position is relative; that of {used} is absolute.",)


def relative_axes(recording: Recording) -> tuple[str, ...]:
    """Axes whose position has a zero of the recording's own."""
    return tuple(axis for axis, info in recording.info.axes.items() if info.position_relative)


def moved(recording: Recording, zeros: Mapping[str, float]) -> Recording:
    """A recording whose position on some axes counts from another zero [rad or m]."""
    columns = {
        axis: {
            name: values + zeros[axis] if axis in zeros and name in PLACED else values
            for name, values in own.items()
        }
        for axis, own in recording.columns.items()
    }
    return replace(recording, columns=columns)


def zeros_of(
    simulation: Simulation, recording: Recording, axes: Sequence[str], cutoff_hz: float, floating: Collection[str]
) -> dict[str, float]:
    """Zero of each axis whose position the model's torque depends on: least squares over all axes, friction free.

    Torque = model(q + zero) + coulomb sign(v) + viscous v on every axis, and a constant on those that are `floating`, in shares
    of its rms.
    """
    seen = _Seen.of(simulation, recording, min(SLOW_HZ, cutoff_hz), floating)
    names = list(simulation.axes)
    told = [names.index(axis) for axis in axes]
    bounds = {k: zeros_within(simulation, names[k], seen.kinematics.position[:, k]) for k in told}
    told = [k for k in told if seen.depends_on(k, bounds[k])]
    if not told:
        return {}
    zeros = np.zeros(len(names))
    for k in told:
        zeros[k] = 0.5 * sum(bounds[k])
    for _ in range(2 if len(told) > 1 else 1):
        for k in told:
            tried = np.linspace(*bounds[k], PLACES)
            left = [float(np.sum(seen.left(_with(zeros, k, value)) ** 2)) for value in tried]
            zeros[k] = tried[int(np.argmin(left))]

    def left_at(values: Array) -> Array:
        at = zeros.copy()
        at[told] = values
        return seen.left(at)

    low, high = np.array([bounds[k] for k in told]).T
    first, step = np.clip(zeros[told], low, high), np.array([MOVED])
    found = least_squares(left_at, first, bounds=(low, high), diff_step=step, max_nfev=20)
    return {names[k]: float(value) for k, value in zip(told, found.x, strict=True)}


def _with(zeros: Array, k: int, value: float) -> Array:
    changed = zeros.copy()
    changed[k] = value
    return changed


def zeros_within(simulation: Simulation, axis: str, position: Array) -> tuple[float, float]:
    """Zeros that keep the motion within the joint's range; a whole turn, or ten times the travel, of a joint without one."""
    joint = simulation.model.joint(simulation.drives[axis].joint)
    if joint.limited[0]:
        low, high = float(joint.range[0]) - float(position.min()), float(joint.range[1]) - float(position.max())
        if high > low:
            return low, high
    half = 10.0 * float(np.ptp(position)) if int(joint.type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE) else np.pi
    return -max(half, 1e-6), max(half, 1e-6)


@dataclass(frozen=True)
class _Seen:
    """A recording's slow motion and torque (n, k) of all axes, and rms of each axis's torque (k,).

    `floats` (k,): whose torque is known but for a constant.
    """

    simulation: Simulation
    kinematics: Kinematics
    torque: Array
    size: Array
    floats: NDArray[np.bool_]

    @classmethod
    def of(cls, simulation: Simulation, recording: Recording, cutoff_hz: float, floating: Collection[str]) -> _Seen:
        period = recording.info.sample_period
        cutoff = effective_cutoff(period, cutoff_hz)
        every = max(1, len(recording.time) // SAMPLES)
        kinematics = Kinematics.of(recording, simulation.axes, cutoff).every(every)
        torque = np.column_stack([zero_phase(torque_of(recording, axis), period, cutoff) for axis in simulation.axes])
        floats = np.array([axis in floating for axis in simulation.axes])
        size = np.maximum(np.sqrt(np.mean((torque - floats * torque.mean(axis=0)) ** 2, axis=0)), 1e-12)
        return cls(simulation, kinematics, torque[::every], size, floats)

    def _model(self, zeros: Array) -> Array:
        own = self.kinematics
        return self.simulation.torques(Kinematics(own.position + zeros, own.velocity, own.acceleration))

    def depends_on(self, k: int, span: tuple[float, float]) -> bool:
        """Whether any axis's torque changes with the zero of the k-th axis."""
        few = [self._model(_with(np.zeros(len(self.size)), k, value)) for value in np.linspace(*span, 5)]
        seen = [one - self.floats * one.mean(axis=0) for one in few]
        return bool(np.any(np.sqrt(np.mean(np.ptp(seen, axis=0) ** 2, axis=0)) > DEPENDS * self.size))

    def left(self, zeros: Array) -> Array:
        """Torque that model and friction leave, in shares of each axis's rms; axes one after the other."""
        parts = []
        for k, rest in enumerate((self.torque - self._model(zeros)).T):
            velocity = self.kinematics.velocity[:, k]
            free = np.column_stack([np.sign(velocity), velocity, np.full(len(velocity), float(self.floats[k]))])
            parts.append((rest - free @ np.linalg.lstsq(free, rest, rcond=None)[0]) / self.size[k])
        return np.concatenate(parts)
