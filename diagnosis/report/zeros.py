"""Recordings whose position has a zero of its own: moved to where what was found gives their torque best.

What was found has an absolute position, or one within a turn of the motor (`prepare/turns.py`). Where the model's torque tells
no zero, as on a level slide, an effect of the position would be judged at a wrong place.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import gcd

import numpy as np
from scipy.optimize import minimize_scalar

from drivetwin.diagnosis.prepare.channel import torque_of
from drivetwin.diagnosis.prepare.positions import moved, zeros_of, zeros_within
from drivetwin.diagnosis.prepare.prepared import Aside, Prepared
from drivetwin.diagnosis.prepare.run import OF_POSITION, WHOLE, Run
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.diagnosis.report.prediction import Patch, contributions, gap_rms, predict
from drivetwin.emulator.effects.base import Look
from drivetwin.recording.recording import TORQUE, Recording

TRIED = 400
"""Zeros over an axis's range, or over two turns of its motor, before the best is moved: a wave shorter than a hundredth of that
is not placed."""
NEAR = 0.1
"""By how much a zero of a hinge that the model tells may be off [rad]: on six machines with causes it was 0.08 at most."""


def placed_by(ready: Prepared, patch: Patch) -> Prepared:
    """The same, each validation recording that is adrift placed by the patch's effects of the position; with a note of each."""
    told = _axes_of_position(patch, wave=True) | _axes_of_position(patch, wave=False)
    checks, notes = [], []
    for run in ready.checks:
        sought = [axis for axis in ready.adrift.get(run.recording.name, ()) if axis in told]
        zeros = {axis: _zero(ready.simulation, run, patch, axis, _range(ready.simulation, run, axis)) for axis in sought}
        checks.append(run.placed(zeros) if zeros else run)
        notes += [
            f"{run.recording.name}: the position is relative; by what was found its zero is at {at}."
            for at in _with_units(ready.simulation, zeros)
        ]
    return replace(ready, checks=checks, notes=(*ready.notes, *notes))


def with_aside(ready: Prepared, patch: Patch) -> Prepared:
    """The same with the recordings that were left aside fitted too, each placed by the model and what was found on the others.

    Where neither tells the zero of an axis, no effect of the position was found on it. Such an effect is then asked for on the
    others alone.
    """
    more = [_placed(ready, aside, patch) for aside in ready.aside]
    return ready.with_more([run for run, _ in more], [note for _, note in more])


def _placed(ready: Prepared, aside: Aside, patch: Patch) -> tuple[Run, str]:
    """A recording, placed, and a note of that."""
    by_wave, otherwise = (_axes_of_position(patch, wave=wave) for wave in (True, False))
    zeros = _by_the_model(ready, aside, patch)
    run = aside.prepare(moved(aside.recording, zeros))
    sought = [axis for axis in aside.relative if axis in by_wave | otherwise]
    near = {axis: _zero_of(ready.simulation, run.thinned(), patch, axis, aside) for axis in sought}
    unknown = [axis for axis in aside.adrift if axis not in near]
    run = aside.prepare(moved(run.recording, {**near, **_amid(ready.runs, run, unknown)}))
    unplaced = frozenset(axis for axis in aside.adrift if axis not in otherwise)
    within = {axis: _waves_within(ready.simulation, patch, axis) for axis in aside.relative}
    known = {axis: way for axis, way in within.items() if way < np.inf}
    note = _how_placed(ready.simulation, aside, _sum(aside.zeros, zeros, near), unplaced, known)
    return replace(run, unplaced=unplaced, waves_within=known), note


def _axes_of_position(patch: Patch, *, wave: bool) -> set[str]:
    """Axes with an effect of the position that is a wave, or with one that is none."""
    found = [one for one in patch.effects if one.effect.needs & OF_POSITION]
    return {one.axis for one in found if (Look.WAVE in one.effect.looks) is wave}


def _amid(runs: Sequence[Run], one: Run, axes: Sequence[str]) -> dict[str, float]:
    """By how much axes of a recording have to move to the middle of the others: a spring far away would be wound up there."""
    middle = {axis: np.median(np.concatenate([run.axes[axis].motion.position for run in runs])) for axis in axes}
    return {axis: float(middle[axis] - np.median(one.axes[axis].motion.position)) for axis in axes}


def _waves_within(simulation: Simulation, patch: Patch, axis: str) -> float:
    """Way within which the waves that were found tell where an axis is [rad or m]: all of them come back after it.

    0 where none was found; infinite where several do not come back within a turn of the motor.
    """
    dynamics = simulation.dynamics()[axis]
    effects = [one.effect for one in patch.effects if one.axis == axis and one.effect.needs & OF_POSITION]
    periods = [effect.repeats(dynamics) for effect in effects if Look.WAVE in effect.looks]
    if len(periods) < 2:
        return periods[0] if periods else 0.0
    turn = 2.0 * np.pi / dynamics.gear_ratio
    orders = [turn / period for period in periods]
    whole = [round(order) for order in orders]
    if any(abs(order - number) > WHOLE for order, number in zip(orders, whole, strict=True)):
        return float(np.inf)
    return turn / gcd(*whole)


def _by_the_model(ready: Prepared, aside: Aside, patch: Patch) -> dict[str, float]:
    """By how much further the zeros are that the model tells, where what was found takes its part of the torque."""
    axes = [axis for axis in aside.relative if axis not in aside.adrift]
    if not axes or not patch.effects:
        return {}
    floating = [axis for axis, how in ready.asking.unrecorded.items() if how.floats]
    left = _without(ready.simulation, aside.prepare(aside.recording), patch)
    return zeros_of(ready.simulation, left, axes, ready.cutoff_hz, floating)


def _without(simulation: Simulation, run: Run, patch: Patch) -> Recording:
    """The recording without the torque that a patch adds, at the moment of the motion that needs it."""
    recording = run.recording
    columns = {axis: {**own, TORQUE: torque_of(recording, axis)} for axis, own in recording.columns.items()}
    for part in contributions(simulation, run, patch):
        for axis, torque in part.items():
            columns[axis][TORQUE] = columns[axis][TORQUE] - torque
    axes = {
        axis: told.model_copy(update={"torque_delay": None, "torque_bandwidth_hz": None})
        for axis, told in recording.info.axes.items()
    }
    return replace(recording, columns=columns, info=recording.info.model_copy(update={"axes": axes}))


def _zero_of(simulation: Simulation, run: Run, patch: Patch, axis: str, aside: Aside) -> float:
    """Zero [rad or m] of an axis by what was found: over the joint's range where the model does not tell it, then within a turn
    of the motor, for waves of its angle.
    """
    turn, adrift = 2.0 * np.pi / simulation.dynamics()[axis].gear_ratio, axis in aside.adrift
    low, high = _range(simulation, run, axis)
    far = _zero(simulation, run, patch, axis, (low, high)) if adrift else 0.0
    near = turn if adrift or simulation.slides(axis) else NEAR
    within = max(-near, min(low - far, 0.0)), min(near, max(high - far, 0.0))
    return far + _zero(simulation, run.placed({axis: far}), patch, axis, within)


def _range(simulation: Simulation, run: Run, axis: str) -> tuple[float, float]:
    return zeros_within(simulation, axis, run.axes[axis].motion.position)


def _zero(simulation: Simulation, run: Run, patch: Patch, axis: str, within: tuple[float, float]) -> float:
    """Zero [rad or m] `within` some, with which least of the axis's gap is left; 0 where no other is better."""
    own = replace(patch, effects=tuple(one for one in patch.effects if one.axis == axis), heavier=None)
    unfelt = replace(run, coupling={})  # what other axes feel of it takes the time, and is not asked for
    low, high = within

    def left(zero: float) -> float:
        there = unfelt.placed({axis: zero}).with_weight_moved(axis, zero)
        return gap_rms([predict(simulation, there, own)], axis, "after")

    tried = np.append(np.linspace(low, high, TRIED), 0.0)
    best = float(min(tried, key=left))
    step = (high - low) / (TRIED - 1)
    near = minimize_scalar(left, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-3 * step})
    return float(near.x) if left(float(near.x)) < left(best) else best


def _sum(*parts: Mapping[str, float]) -> dict[str, float]:
    """Zeros on top of others."""
    axes = dict.fromkeys(axis for part in parts for axis in part)
    return {axis: sum(part.get(axis, 0.0) for part in parts) for axis in axes}


def _how_placed(
    simulation: Simulation, aside: Aside, zeros: Mapping[str, float], unplaced: Collection[str], within: Mapping[str, float]
) -> str:
    at = ", ".join(_with_units(simulation, zeros))
    found = [f"by the model and what was found on the others its zero is at {at}"] if at else []
    nothing = [axis for axis in unplaced if not within.get(axis)]
    wave = [axis for axis in unplaced if within.get(axis)]
    some = [axis for axis in aside.relative if axis not in unplaced and axis in within and not within[axis]]
    rest = [
        f"{words} of {', '.join(axes)}: {what} are sought on the others"
        for words, what, axes in (
            ("nothing shows the zero", "effects of the position", nothing),
            ("but for whole waves nothing shows the zero", "springs and weights", wave),
            ("nothing shows the motor's angle", "waves", some),
        )
        if axes
    ]
    return f"{aside.recording.name}: the position is relative; {'; '.join([*found, *rest])}."


def _with_units(simulation: Simulation, zeros: Mapping[str, float]) -> list[str]:
    return [f"{axis} {zero:+.3g} {'m' if simulation.slides(axis) else 'rad'}" for axis, zero in zeros.items()]
