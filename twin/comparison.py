"""A replay compared with its recording: each signal of each axis, measured and simulated, and their difference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.effects import PlacedEffect
from drivetwin.motion.filtering import derivative, effective_cutoff, reach, zero_phase
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.twin.replay import AxisReplay, replay

Array = NDArray[np.float64]

SIGNALS = ("position", "velocity", "acceleration", "torque", "following_error")
UNITS = {
    False: dict(zip(SIGNALS, ("rad", "rad/s", "rad/s²", "N·m", "rad"), strict=True)),
    True: dict(zip(SIGNALS, ("m", "m/s", "m/s²", "N", "m"), strict=True)),
}
"""By whether the axis slides."""


@dataclass(frozen=True)
class Apart:
    """How far a simulated signal is from the measured one: rms of the difference, and its 2-norm over that of the measured."""

    rms: float
    relative: float


@dataclass(frozen=True)
class Run:
    """The model as it stands, or with effects: `signals` (n,) by name, and how far each is from the measured one."""

    signals: dict[str, Array]
    apart: dict[str, Apart]


@dataclass(frozen=True)
class AxisComparison:
    """One axis of a recording: what was measured, and what the runs make of it; `used` (n,) are the samples that count.

    `moves`: whether it is commanded to. Of an axis at rest nothing is left to relate a difference to.
    """

    axis: str
    loops: str
    units: dict[str, str]
    measured: dict[str, Array]
    used: NDArray[np.bool_]
    runs: dict[str, Run]
    moves: bool = True


@dataclass(frozen=True)
class Comparison:
    """A recording replayed; `time` (n,) [s], `cutoff_hz` of the filter [Hz]."""

    recording: str
    time: Array
    period: float
    cutoff_hz: float
    axes: dict[str, AxisComparison]

    @property
    def moving(self) -> dict[str, AxisComparison]:
        """The axes that are commanded to move."""
        return {name: axis for name, axis in self.axes.items() if axis.moves}


MODEL, WITH_EFFECTS = "model", "with_effects"


def compared(
    path: Path,
    recording: Recording,
    effects: tuple[PlacedEffect, ...] | None,
    cutoff_hz: float,
    *,
    patched: Path | None = None,
) -> Comparison:
    """Replay a recording on the model of an MJCF file without effects, and with them where there are any; raises as `replay`.

    `patched`: the file in which the effects act, where their model is another one.

    Velocity and acceleration are central differences of the filtered position, torque is filtered; position and following error
    are as they are. The filter's reach is left out at both ends.
    """
    period = recording.info.sample_period
    cutoff_hz = effective_cutoff(period, cutoff_hz)
    runs = {MODEL: replay(path, recording, ())}
    if effects is not None:
        runs[WITH_EFFECTS] = replay(patched or path, recording, effects)
    slides = _slides(path, recording)
    axes = {
        axis: _axis(recording, axis, {name: run[axis] for name, run in runs.items()}, slides[axis], cutoff_hz)
        for axis in recording.info.axes
    }
    return Comparison(recording.name, recording.time, period, cutoff_hz, axes)


def worst(comparisons: Sequence[Comparison]) -> Iterator[tuple[Comparison, AxisComparison]]:
    """For each axis that moves the recording in which the model as it stands is furthest off, by torque or else by position."""
    for axis in dict.fromkeys(name for each in comparisons for name in each.moving):
        having = [each for each in comparisons if axis in each.moving]
        furthest = max(having, key=lambda each: _how_far(each.axes[axis]))
        yield furthest, furthest.axes[axis]


def _how_far(axis: AxisComparison) -> float:
    apart = axis.runs[MODEL].apart
    return apart["torque" if "torque" in apart else "position"].relative


def _slides(path: Path, recording: Recording) -> dict[str, bool]:
    model = read_mjcf(path)
    slide = int(mujoco.mjtJoint.mjJNT_SLIDE)
    return {axis: int(model.joint(info.joint).type[0]) == slide for axis, info in recording.info.axes.items()}


def _axis(
    recording: Recording, axis: str, replayed: Mapping[str, AxisReplay], slides: bool, cutoff_hz: float
) -> AxisComparison:
    columns, period = recording.columns[axis], recording.info.sample_period
    demand = columns.get("position_demand")
    measured = _signals(columns["position"], columns.get("torque"), demand, period, cutoff_hz)
    margin = min(reach(period, cutoff_hz), len(recording.time) // 4)
    used = np.zeros(len(recording.time), dtype=np.bool_)
    used[margin : len(used) - margin] = True
    runs = {}
    for name, run in replayed.items():
        signals = _signals(run.position, run.torque, demand, period, cutoff_hz)
        runs[name] = Run(signals, {key: _apart(values[used], signals[key][used]) for key, values in measured.items()})
    moves = demand is None or float(np.ptp(demand)) > 0.0
    return AxisComparison(axis, replayed[MODEL].loops.told_by, UNITS[slides], measured, used, runs, moves)


def _signals(
    position: Array, torque: Array | None, demand: Array | None, period: float, cutoff_hz: float
) -> dict[str, Array]:
    velocity = derivative(zero_phase(position, period, cutoff_hz), period)
    found = {"position": position, "velocity": velocity, "acceleration": derivative(velocity, period)}
    if torque is not None:
        found["torque"] = zero_phase(torque, period, cutoff_hz)
    if demand is not None:
        found["following_error"] = demand - position
    return found


def _apart(measured: Array, simulated: Array) -> Apart:
    away, size = float(np.linalg.norm(measured - simulated)), float(np.linalg.norm(measured))
    return Apart(away / np.sqrt(max(1, len(measured))), away / size if size > 0.0 else 0.0)
