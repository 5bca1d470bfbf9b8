"""What the simulation predicts for a recording's motion, without effects and with some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.prepare.drive_law import asked_of
from diagnosis.prepare.motion import Run, between
from diagnosis.prepare.simulation import Simulation
from diagnosis.propose.drives import given_with
from diagnosis.report.result import AxisPrediction, Prediction
from emulator.dynamics import AxisDynamics
from emulator.effects import AxisEffect, DriveEffect, ModelEffect, PlacedEffect

Array = NDArray[np.float64]

SMOOTH_RATE = 6.0
"""Samples a period of the cut-off at which the rigid bodies are evaluated; between them a cubic spline."""


@dataclass(frozen=True)
class Patch:
    """What is added to a simulation: effects in the order in which torque passes them, and bodies heavier by a share."""

    effects: tuple[PlacedEffect, ...] = ()
    heavier: Mapping[int, float] | None = None


def predict(simulation: Simulation, run: Run, patch: Patch) -> Prediction:
    """Torque of every axis over one prepared recording, before and after the patch, through the comparison's filter.

    Effects between the torque asked and the torque given are no matter of the measured motion: their difference, which the
    drive's law tells, stands in what is predicted without them.
    """
    unlimited = {axis: np.zeros(len(run.recording.time)) for axis in simulation.axes}
    for placed in patch.effects:
        if isinstance(placed.effect, DriveEffect):
            unlimited[placed.axis] = unlimited[placed.axis] + _not_given(run, placed.axis, placed.effect)
    changes = {axis: np.zeros(len(run.recording.time)) for axis in simulation.axes}
    for part in contributions(simulation, run, patch):
        for axis, torque in part.items():
            changes[axis] = changes[axis] + torque
    axes = {}
    for k, axis in enumerate(simulation.axes):
        own = run.axes[axis]
        axes[axis] = AxisPrediction(
            before=own.base + unlimited[axis],
            after=own.base + changes[axis],
            measured=own.torque,
            used=own.used,
            position=run.kinematics.position[:, k],
            velocity=run.kinematics.velocity[:, k],
            acceleration=run.kinematics.acceleration[:, k],
        )
    return Prediction(run.recording.name, run.recording.time, axes)


def contributions(simulation: Simulation, run: Run, patch: Patch) -> list[dict[str, Array]]:
    """Torque (n,) that each effect of a patch adds, by axis, in their order, and then each heavier body."""
    parts = []
    for number, placed in enumerate(patch.effects):
        drives = isinstance(placed.effect, DriveEffect)
        parts.append({} if drives else cost(simulation, run, placed, simulation.dynamics(patch.effects[:number])))
    for body, share in (patch.heavier or {}).items():
        parts.append({axis: share * torque for axis, torque in _of_body(simulation, run, body).items()})
    return parts


def cost(simulation: Simulation, run: Run, placed: PlacedEffect, dynamics: Mapping[str, AxisDynamics]) -> dict[str, Array]:
    """Torque (n,) that an effect costs on the axes that it acts on, filtered."""
    effect = placed.effect
    if isinstance(effect, AxisEffect):
        return run.cost(placed.axis, effect, dynamics[placed.axis])
    if isinstance(effect, ModelEffect):
        stride = max(1, int(1.0 / (SMOOTH_RATE * run.cutoff_hz * run.period)))
        few = run.kinematics.every(stride)
        torque = simulation.torques_of(simulation.rigid_with(placed.axis, effect), few) - simulation.torques(few)
        return _by_axis(simulation, run, torque, stride)
    return {}


def _of_body(simulation: Simulation, run: Run, body: int) -> dict[str, Array]:
    stride = max(1, int(1.0 / (SMOOTH_RATE * run.cutoff_hz * run.period)))
    few = run.kinematics.every(stride)
    torque = simulation.torques_of(simulation.rigid_with_heavier(body), few) - simulation.torques(few)
    return _by_axis(simulation, run, torque, stride)


def _by_axis(simulation: Simulation, run: Run, torque: Array, stride: int) -> dict[str, Array]:
    whole = between(torque, len(run.recording.time), stride)
    return {axis: whole[:, k] * run.moves(run.axes[axis]) for k, axis in enumerate(simulation.axes)}


def _not_given(run: Run, axis: str, effect: DriveEffect) -> Array:
    """What the loops asked for and did not get."""
    asked = asked_of(run, axis)
    if asked is None:
        return np.zeros(len(run.recording.time))
    return run.smooth(asked.lagged - given_with(asked, effect, run.period))


def gap_rms(predictions: Sequence[Prediction], axis: str, of: str = "before") -> float:
    """Root mean square of measured less predicted (`before` or `after`) over the samples in use, by time; 0 without any."""
    energy = seconds = 0.0
    for each in predictions:
        part = each.axes[axis]
        gap = (part.measured - getattr(part, of))[part.used]
        energy += each.period * float(gap @ gap)
        seconds += each.period * len(gap)
    return float(np.sqrt(energy / seconds)) if seconds else 0.0
