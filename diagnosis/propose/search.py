"""Looks for one effect on one axis: a coarse search that is linear, then a local one in the effect's own parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from drivetwin.diagnosis.model.solve import Fit
from drivetwin.diagnosis.model.system import System
from drivetwin.diagnosis.prepare.rows import Column, Rows
from drivetwin.diagnosis.propose.side_by_side import side_by_side
from drivetwin.emulator.dynamics import AxisDynamics, Motion
from drivetwin.emulator.effects import AxisEffect, Effect, Start
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

REFINED = 2
"""Starts of one effect on one axis that are moved, the best by a linear fit."""
REFINED_REPLAYS = 3
"""The same where a motion is replayed, and each start has a valley of its own."""
STEP = 1e-3
"""Of a parameter's own size, for differences, where the torque is a smooth function of it."""
ANGLES = ("phase", "angle")
FAR = 1e9
"""Residual of an effect that nothing can follow: a spring too stiff, a period of nothing."""
EVALUATIONS = 20
"""Of a local search, Jacobians not counted: it begins near."""
BRIEFLY = 4
"""Of one that only has to tell whether its start is worth more."""
ONE_STEP = 2
"""Of one that only goes downhill once."""

Predict = Callable[[Effect], Column]


@dataclass(frozen=True)
class Begun:
    """An effect on an axis as a linear fit composed it, and the evidence of that fit [nats]."""

    axis: str
    effect: Effect
    evidence: float
    tried: int
    """Starts that were compared: a look elsewhere costs the logarithm of their number."""


@dataclass(frozen=True)
class Field:
    """A parameter of an effect as a local search moves it: a step that matters, its bounds, the share of it for differences."""

    name: str
    size: float
    low: float
    high: float
    difference: float


@dataclass(frozen=True)
class Beginnings:
    """Where a search for a kind of effect begins on an axis, on top of what the axis is: what each start's members cost."""

    axis: str
    kind: type[AxisEffect]
    dynamics: AxisDynamics
    starts: Sequence[Start]
    costs: Sequence[Sequence[Column]]


def beginnings(rows: Rows, axis: str, kind: type[AxisEffect], dynamics: AxisDynamics) -> Beginnings:
    """The starts that a kind has for a motion. Raises UserError where nothing can follow one."""
    starts = kind.starts(rows.motion[axis], dynamics)
    members = [member for start in starts for member in start.members]
    costs = iter(side_by_side(lambda member: rows.cost(axis, member, dynamics), members))
    return Beginnings(axis, kind, dynamics, starts, [[next(costs) for _ in start.members] for start in starts])


def coarse(begin: Beginnings, system: System, held: frozenset[int]) -> list[Begun]:
    """The starts of an effect on an axis, best first, each with the coefficients of its members free."""
    found, count = [], len(begin.starts)
    for start, costs in zip(begin.starts, begin.costs, strict=True):
        own = [system.whiten(cost) for cost in costs]
        if not all(np.isfinite(each[begin.axis]).all() and each[begin.axis].any() for each in own):
            continue
        if not begin.kind.scales:
            found.append(Begun(begin.axis, start.members[0], system.fit((), own[0], held).evidence, count))
            continue
        fit = system.fit(own, held=held)
        effect = start.compose([float(value) for value in fit.coefficients[-len(own) :]])
        if effect is not None:
            found.append(Begun(begin.axis, effect, fit.evidence, count))
    return sorted(found, key=lambda one: -one.evidence)


def moved(
    system: System,
    fit: Fit,
    effect: Effect,
    movable: Sequence[Field],
    predict: Predict,
    held: frozenset[int],
    evaluations: int = EVALUATIONS,
) -> Effect:
    """The local search: least squares in a trust region (Branch, Coleman, Li 1999) within bounds, all else projected out."""
    start = np.array([getattr(effect, field.name) / field.size for field in movable])
    if not np.isfinite(start).all():
        return effect
    low = np.array([field.low / field.size for field in movable])
    high = np.array([field.high / field.size for field in movable])
    steps = np.array([field.difference for field in movable])
    start = np.clip(start, np.nextafter(low, np.inf), np.nextafter(high, -np.inf))
    try:  # a step off its bounds: of size 0 an effect is felt by its own axis alone
        felt = predict(at(effect, movable, np.where(start - low < steps, np.minimum(low + steps, high), start)))
    except UserError:
        return effect
    axes = [axis for axis in system.axes if axis in felt]
    project = system.projector(axes, fit, held)

    def torque(values: Array) -> Column:
        column = system.whiten(predict(at(effect, movable, values)))
        return {axis: column[axis] if axis in column else np.zeros_like(system.axes[axis].target) for axis in axes}

    lengths: list[int] = []

    def left(values: Array) -> Array:
        column = torque(values)
        rows = project.left({axis: system.axes[axis].target - column[axis] for axis in axes})
        lengths.append(len(rows))
        return rows if np.isfinite(rows).all() else np.full(len(rows), FAR)

    def slopes(values: Array) -> Array:
        """Differences to one side, away from a bound; a relative step would be none for a parameter at 0. None after the last
        evaluation, where no step follows."""
        if len(lengths) >= evaluations:
            return np.zeros((lengths[-1], len(values)))
        ways = np.where(values + steps <= high, steps, -steps)
        here, *there = side_by_side(torque, [values, *(values + np.diag(ways))])
        differences = {
            axis: np.column_stack([(here[axis] - each[axis]) / way for each, way in zip(there, ways, strict=True)])
            for axis in axes
        }
        able = all(np.isfinite(rows).all() for rows in differences.values())
        return project.left(differences if able else {axis: np.zeros_like(rows) for axis, rows in differences.items()})

    try:
        found = least_squares(
            left, start, jac=slopes, bounds=(low, high), x_scale=1.0, max_nfev=evaluations, xtol=1e-4, ftol=1e-5
        )
    except UserError:
        return effect
    return at(effect, movable, found.x)


def movable_fields(effect: Effect, motion: Motion, axis: AxisDynamics, wide_step: float) -> list[Field]:
    """The effect's parameters, each with the step that matters to it; angles turn freely. `wide_step`: of `Settings`."""
    sizes = effect.sizes(motion, axis)
    fixed, bounds = effect.fixed(axis), effect.bounds(motion, axis)
    step = wide_step if isinstance(effect, AxisEffect) and not effect.scales else STEP
    return [
        Field(one.name, sizes[one.name], -np.inf if one.name in ANGLES else bounds[one.name][0], bounds[one.name][1], step)
        for one in type(effect).parameters
        if one.name not in fixed
    ]


def at(effect: Effect, movable: Sequence[Field], values: Array) -> Effect:
    """The effect with other values, in the sizes of its fields."""
    changed = {field.name: float(value * field.size) for field, value in zip(movable, values, strict=True)}
    return replace(effect, **changed)


def tangents(effect: Effect, movable: Sequence[Field], predict: Predict) -> list[Column]:
    """d torque / d parameter in units of its size, by central differences within the bounds; 0 where these leave no room."""
    base = np.array([getattr(effect, field.name) / field.size for field in movable])
    ups, downs = [], []
    for k, field in enumerate(movable):
        step = np.zeros_like(base)
        step[k] = field.difference
        ups.append(base + step if (base + step)[k] * field.size <= field.high else base)
        downs.append(base - step if (base - step)[k] * field.size >= field.low else base)
    columns = side_by_side(lambda values: predict(at(effect, movable, values)), [*ups, *downs])
    ways = np.diag(np.array(ups) - np.array(downs))
    ways = np.where(ways > 0.0, ways, 1.0)
    pairs = zip(columns[: len(base)], columns[len(base) :], ways, strict=True)
    return [_slope(above, below, way) for above, below, way in pairs]


def _slope(above: Column, below: Column, way: float) -> Column:
    """Other axes feel nothing of an effect of size 0."""
    none = {axis: np.zeros_like(rows) for axis, rows in (*above.items(), *below.items())}
    return {axis: (above.get(axis, zero) - below.get(axis, zero)) / way for axis, zero in none.items()}
