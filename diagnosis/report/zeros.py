"""Recordings whose position has a zero of its own: moved to where what was found gives their torque best.

What was found has an absolute position, or one within a turn of the motor (`prepare/turns.py`). Where the model's torque tells
no zero, as on a level slide, an effect of the position would be judged at a wrong place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from drivetwin.diagnosis.prepare.positions import moved, zeros_of, zeros_within
from drivetwin.diagnosis.prepare.prepared import OF_POSITION, Aside, Prepared
from drivetwin.diagnosis.prepare.run import Run
from drivetwin.diagnosis.prepare.simulation import Simulation
from drivetwin.diagnosis.report.prediction import Patch, contributions, gap_rms, predict
from drivetwin.recording.recording import TORQUE, Recording

TRIED = 400
"""Zeros over an axis's range, or over two turns of its motor, before the best is moved: a wave shorter than a hundredth of that
is not placed."""


def placed_by(ready: Prepared, patch: Patch) -> Prepared:
    """The same, each validation recording that is adrift placed by the patch's effects of the position; with a note of each."""
    told = _axes_of_position(patch)
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

    An axis of which neither tells the zero stays where it began: no effect of the position was found on it.
    """
    told = _axes_of_position(patch)
    more, notes = {}, []
    for aside in ready.aside:
        zeros = _by_the_model(ready, aside, patch)
        run = aside.prepare(moved(aside.recording, zeros))
        waves = {axis: _zero_of(ready.simulation, run, patch, axis, aside) for axis in aside.relative if axis in told}
        more[aside.recording.name] = aside.prepare(moved(run.recording, waves)) if waves else run
        notes.append(_how_placed(ready.simulation, aside, _sum(aside.zeros, zeros, waves)))
    unplaced = {axis for aside in ready.aside for axis in aside.adrift if axis not in told}
    return ready.with_more(more, frozenset(unplaced), notes)


def _axes_of_position(patch: Patch) -> set[str]:
    return {one.axis for one in patch.effects if one.effect.needs & OF_POSITION}


def _by_the_model(ready: Prepared, aside: Aside, patch: Patch) -> dict[str, float]:
    """By how much further the zeros are that the model tells, where what was found takes its part of the torque."""
    axes = [axis for axis in aside.relative if axis not in aside.adrift]
    if not axes or not patch.effects:
        return {}
    floating = [axis for axis, how in ready.asking.unrecorded.items() if how.floats]
    left = _without(ready.simulation, aside.prepare(aside.recording), patch)
    return zeros_of(ready.simulation, left, axes, ready.cutoff_hz, floating)


def _without(simulation: Simulation, run: Run, patch: Patch) -> Recording:
    """The recording without the torque that a patch adds."""
    columns = dict(run.recording.columns)
    for part in contributions(simulation, run, patch):
        for axis, torque in part.items():
            columns[axis] = {**columns[axis], TORQUE: columns[axis][TORQUE] - torque}
    return replace(run.recording, columns=columns)


def _zero_of(simulation: Simulation, run: Run, patch: Patch, axis: str, aside: Aside) -> float:
    """Zero [rad or m] of an axis by what was found: over the joint's range where the model does not tell it, then within a turn
    of the motor, for waves of its angle.
    """
    turn = 2.0 * np.pi / simulation.dynamics()[axis].gear_ratio
    far = _zero(simulation, run, patch, axis, _range(simulation, run, axis)) if axis in aside.adrift else 0.0
    return far + _zero(simulation, run.placed({axis: far}), patch, axis, (-turn, turn))


def _range(simulation: Simulation, run: Run, axis: str) -> tuple[float, float]:
    return zeros_within(simulation, axis, run.axes[axis].motion.position)


def _zero(simulation: Simulation, run: Run, patch: Patch, axis: str, within: tuple[float, float]) -> float:
    """Zero [rad or m] `within` some, with which least of the axis's gap is left; 0 where no other is better."""
    own = replace(patch, effects=tuple(one for one in patch.effects if one.axis == axis), heavier=None)
    low, high = within

    def left(zero: float) -> float:
        there = run.placed({axis: zero}).with_weight_at({axis: zero})
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


def _how_placed(simulation: Simulation, aside: Aside, zeros: Mapping[str, float]) -> str:
    at, untold = ", ".join(_with_units(simulation, zeros)), ", ".join(axis for axis in aside.adrift if axis not in zeros)
    found = [f"by the model and what was found on the others its zero is at {at}"] if at else []
    rest = [f"nothing tells the zero of {untold}: effects of the position are sought on the others"] if untold else []
    return f"{aside.recording.name}: the position is relative; {'; '.join([*found, *rest])}."


def _with_units(simulation: Simulation, zeros: Mapping[str, float]) -> list[str]:
    return [f"{axis} {zero:+.3g} {'m' if simulation.slides(axis) else 'rad'}" for axis, zero in zeros.items()]
