"""What the simulation predicts for a recording's motion, without effects and with some."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.drive_law import asked_of, given_with
from drivetwin.diagnosis.prepare.motion import between
from drivetwin.diagnosis.prepare.run import AxisRun, Run
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.diagnosis.report.result import AxisPrediction, Prediction
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import AxisEffect, DriveEffect, ModelEffect, PlacedEffect, UnnamedEffect
from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import Model

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

    What the drive's loops asked for and did not get is no matter of the measured motion: it stands in what is predicted without
    the effects of the drive.
    """
    changes = {axis: np.zeros(len(run.recording.time)) for axis in simulation.axes}
    not_given = {axis: np.zeros(len(run.recording.time)) for axis in simulation.axes}
    effects: Sequence[PlacedEffect | None] = (*patch.effects, *(None for _ in patch.heavier or {}))
    for placed, part in zip(effects, contributions(simulation, run, patch), strict=True):
        into = not_given if placed is not None and isinstance(placed.effect, DriveEffect) else changes
        for axis, torque in part.items():
            into[axis] = into[axis] + torque
    axes = {}
    for k, axis in enumerate(simulation.axes):
        own = run.axes[axis]
        axes[axis] = AxisPrediction(
            before=_level(own, own.base - not_given[axis]),
            after=_level(own, own.base + changes[axis]),
            measured=own.torque,
            used=own.used,
            position=run.kinematics.position[:, k],
            velocity=run.kinematics.velocity[:, k],
            acceleration=run.kinematics.acceleration[:, k],
        )
    return Prediction(run.recording.name, run.recording.time, axes)


def _level(own: AxisRun, predicted: Array) -> Array:
    """A predicted torque (n,) as the drive's integral has it, where the torque is known but for a constant."""
    return predicted + np.mean((own.torque - predicted)[own.used]) if _floats(own) else predicted


def without_level(own: AxisRun, torque: Array) -> Array:
    """A torque (n,) less its mean over the samples in use, where the torque is known but for a constant: the gap has none."""
    return torque - np.mean(torque[own.used]) if _floats(own) else torque


def _floats(own: AxisRun) -> bool:
    return own.asked is not None and own.asked.floats and bool(own.used.any())


def contributions(simulation: Simulation, run: Run, patch: Patch) -> list[dict[str, Array]]:
    """Torque (n,) that each effect of a patch adds, by axis, in their order, and then each heavier body."""
    parts = []
    for number, placed in enumerate(patch.effects):
        before = patch.effects[:number]
        if isinstance(placed.effect, DriveEffect):
            parts.append({placed.axis: _less_given(run, placed.axis, placed.effect, before)})
        else:
            parts.append(cost(simulation, run, placed, simulation.dynamics(before)))
    for body, share in (patch.heavier or {}).items():
        parts.append({axis: share * torque for axis, torque in _of_body(simulation, run, body).items()})
    return parts


def attributed(simulation: Simulation, run: Run, effects: Sequence[PlacedEffect], number: int, axis: str) -> Array:
    """Torque (n,) on an axis that is one effect's part of what all cost: the mean of what it costs alone and beside the others.

    Of two effects that is Shapley's value (Contributions to the Theory of Games 2, 1953): neither is favoured for coming first.
    Where one of the two makes no mechanism (an asymmetry that would push without another effect), the other one counts.
    """
    one = effects[number]
    none = np.zeros(len(run.recording.time))

    def whole(some: Sequence[PlacedEffect]) -> Array:
        return np.asarray(sum((part.get(axis, none) for part in contributions(simulation, run, Patch(tuple(some)))), none))

    ways = []
    with suppress(UserError):
        ways.append(whole([one]))
    with suppress(UserError):
        ways.append(whole(effects) - whole([each for each in effects if each is not one]))
    if not ways:
        ways.append(contributions(simulation, run, Patch(tuple(effects)))[number].get(axis, none))
    return np.asarray(np.mean(ways, axis=0))


def cost(simulation: Simulation, run: Run, placed: PlacedEffect, dynamics: Mapping[str, AxisDynamics]) -> dict[str, Array]:
    """Torque (n,) that an effect costs on the axes that it acts on, filtered."""
    effect = placed.effect
    if isinstance(effect, AxisEffect):
        return run.cost(placed.axis, effect, dynamics[placed.axis])
    if isinstance(effect, ModelEffect):
        return _beyond_rigid(simulation, run, (placed.axis, effect), lambda: simulation.rigid_with(placed.axis, effect))
    if isinstance(effect, UnnamedEffect):
        own = run.axes[placed.axis]
        return {placed.axis: run.felt(own, effect.predict(own.motion, dynamics[placed.axis]))}
    return {}


def _of_body(simulation: Simulation, run: Run, body: int) -> dict[str, Array]:
    return _beyond_rigid(simulation, run, body, lambda: simulation.rigid_with_heavier(body))


def _beyond_rigid(simulation: Simulation, run: Run, key: Hashable, changed: Callable[[], Model]) -> dict[str, Array]:
    """What changed rigid bodies cost on every axis, (n,): evaluated once a recording, however many patches have the change."""
    stride = max(1, int(1.0 / (SMOOTH_RATE * run.cutoff_hz * run.period)))
    few = run.kinematics.every(stride)
    as_it_stands = run.kept("rigid", lambda: simulation.torques(few))
    torque = run.kept(("changed", key), lambda: simulation.torques_of(changed(), few) - as_it_stands)
    whole = between(torque, len(run.recording.time), stride)
    return {axis: whole[:, k] * run.moves(run.axes[axis]) for k, axis in enumerate(simulation.axes)}


def _less_given(run: Run, axis: str, effect: DriveEffect, before: Sequence[PlacedEffect]) -> Array:
    """What an effect of the drive changes of the torque that is given for what the loops ask."""
    asked = asked_of(run, axis)
    if asked is None:
        return np.zeros(len(run.recording.time))
    others = [one.effect for one in before if one.axis == axis and isinstance(one.effect, DriveEffect)]
    with_it, without = given_with(asked, (*others, effect), run.period), given_with(asked, others, run.period)
    return run.smooth(with_it - without)


def gap_rms(predictions: Sequence[Prediction], axis: str, of: str = "before") -> float:
    """Root mean square of measured less predicted (`before` or `after`) over the samples in use, by time; 0 without any."""
    energy = seconds = 0.0
    for each in predictions:
        part = each.axes[axis]
        gap = (part.measured - getattr(part, of))[part.used]
        energy += each.period * float(gap @ gap)
        seconds += each.period * len(gap)
    return float(np.sqrt(energy / seconds)) if seconds else 0.0
