"""Looks for one effect on one axis: a coarse search that is linear, then a local one in the effect's own parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from diagnosis.comparison import Column, Comparison
from diagnosis.regression import Fitted, Regression
from diagnosis.side_by_side import side_by_side
from drivetwin.errors import UserError
from emulator.dynamics import AxisDynamics
from emulator.effects import AxisEffect, Effect

Array = NDArray[np.float64]

INNER = "transmission"
"""Family of the effects behind which an axis moves otherwise than its motor, by its own friction and inertia."""
STARTS_REFINED = 2
"""Of one effect on one axis."""
STARTS_TRIED = 6
"""Of one of that family: each start has a valley of its own, and is first moved `BRIEFLY`."""
STEP = 1e-3
"""Of a parameter's own size, for differences."""
PLACES = ("x", "y", "z", "rest")
LEAST_PLACE = 0.02
"""Of a place [m or rad], the least that matters: it may well be at 0."""
EVALUATIONS = 25
"""Of a local search, Jacobians not counted: it begins near."""
BRIEFLY = 5
"""Of one that only has to tell whether its start is worth more."""


@dataclass(frozen=True)
class Found:
    """An effect on an axis, the torque that it costs on the compared rows, and what is left with it."""

    axis: str
    effect: Effect
    column: Column
    fitted: Fitted


@dataclass(frozen=True)
class Field:
    """A parameter of an effect as a local search moves it: its name, a step that matters, and its bounds."""

    name: str
    size: float
    low: float
    high: float


Predict = Callable[[Effect], Column]


def coarse(
    comparison: Comparison, regression: Regression, axis: str, kind: type[AxisEffect], dynamics: AxisDynamics
) -> list[Found]:
    """The best starts of an effect on an axis, best first, each with the coefficients of its members free."""
    starts = [
        tried
        for tried in comparison.starts(axis, kind, dynamics)
        if all(np.isfinite(rows).all() and rows.any() for rows in tried.columns)
    ]
    each = regression.fit_each(axis, [tried.columns for tried in starts], held=regression.replaced_by(kind.name, axis))
    found = []
    for tried, fitted in zip(starts, each, strict=True):
        chosen = fitted.coefficients[-len(tried.columns) :]
        effect = tried.start.compose([float(value) for value in chosen])
        if effect is not None:
            whole = {axis: np.column_stack(tried.columns) @ chosen}
            found.append(Found(axis, effect, whole, fitted))
    most = STARTS_TRIED if kind.family == INNER else STARTS_REFINED
    return sorted(found, key=lambda one: -regression.evidence(one.fitted))[:most]


def moved(
    regression: Regression, effect: Effect, predict: Predict, held: frozenset[int], evaluations: int = EVALUATIONS
) -> Effect:
    """The local search: least squares in a trust region (Branch, Coleman, Li 1999) within bounds, all else projected out."""
    movable = movable_fields(effect)
    start = np.array([getattr(effect, field.name) / field.size for field in movable])
    low = np.array([field.low / field.size for field in movable])
    high = np.array([field.high / field.size for field in movable])
    axes = sorted(predict(effect))
    project = _projector(regression, axes, held)

    def left(values: Array) -> Array:
        column = predict(at(effect, movable, values))
        return project({axis: regression.target[axis] - column[axis] for axis in axes})

    def slopes(values: Array) -> Array:
        """Central differences that stay in the bounds; a relative step would be none for a parameter at 0."""
        steps = STEP * np.eye(len(values))
        ups, downs = np.minimum(values + steps, high), np.maximum(values - steps, low)
        rows = side_by_side(left, [*ups, *downs])
        above, below = rows[: len(values)], rows[len(values) :]
        return np.column_stack([(a - b) / way for a, b, way in zip(above, below, np.diag(ups - downs), strict=True)])

    start = np.clip(start, np.nextafter(low, np.inf), np.nextafter(high, -np.inf))
    try:
        solved = least_squares(
            left,
            start,
            jac=slopes,
            bounds=(low, high),
            x_scale=1.0,
            max_nfev=evaluations,
            xtol=1e-4,
            ftol=1e-5,
        )
    except UserError:
        return effect
    return at(effect, movable, solved.x)


def movable_fields(effect: Effect) -> list[Field]:
    """The effect's parameters, each with the step that matters to it."""
    found = []
    for parameter in type(effect).parameters:
        value = float(getattr(effect, parameter.name))
        angle = parameter.name in ("phase", "angle")
        size = 1.0 if angle or value == 0.0 else abs(value)
        if parameter.name in PLACES:
            size = max(abs(value), LEAST_PLACE)
        low = parameter.low if not (angle and parameter.low == 0.0) else -np.inf
        found.append(Field(parameter.name, size, low, parameter.high))
    return found


def at(effect: Effect, movable: Sequence[Field], values: Array) -> Effect:
    """The effect with other values, in the sizes of its fields."""
    changed = {field.name: float(value * field.size) for field, value in zip(movable, values, strict=True)}
    return replace(effect, **changed)


def tangents(effect: Effect, predict: Predict) -> list[Column]:
    """d torque / d parameter in units of its size, by central differences that stay in the bounds."""
    movable = movable_fields(effect)
    base = np.array([getattr(effect, field.name) / field.size for field in movable])
    ups, downs = [], []
    for k, field in enumerate(movable):
        step = np.zeros_like(base)
        step[k] = STEP
        ups.append(base + step if (base + step)[k] * field.size <= field.high else base)
        downs.append(base - step if (base - step)[k] * field.size >= field.low else base)
    columns = side_by_side(lambda values: predict(at(effect, movable, values)), [*ups, *downs])
    ways = np.diag(np.array(ups) - np.array(downs))
    pairs = zip(columns[: len(base)], columns[len(base) :], ways, strict=True)
    return [{axis: (above[axis] - below[axis]) / way for axis in above} for above, below, way in pairs]


def less(target: Mapping[str, Array], column: Column) -> dict[str, Array]:
    """What is left of the target on the axes of a column."""
    return {axis: target[axis] - column[axis] for axis in column}


def _projector(regression: Regression, axes: Sequence[str], held: frozenset[int]) -> Callable[[Mapping[str, Array]], Array]:
    """Weighted residual of rows after the best coefficients on some axes, and below it what their priors cost."""
    matrix = np.vstack([regression.matrix[axis] / regression.scale[axis] for axis in axes])
    prior = np.diag(1.0 / regression.spreads)
    matrix[:, list(held)] = 0.0
    size = np.sqrt(np.einsum("np,np->p", matrix, matrix) + np.diag(prior) ** 2)
    size[size == 0.0] = 1.0
    gram = (matrix.T @ matrix + prior**2) / np.outer(size, size) + 1e-10 * np.eye(len(size))
    inverse = np.linalg.inv(gram) / np.outer(size, size)

    def left(rows: Mapping[str, Array]) -> Array:
        y = np.concatenate([rows[axis] / regression.scale[axis] for axis in axes])
        coefficients = inverse @ (matrix.T @ y)
        return np.concatenate([y - matrix @ coefficients, prior @ coefficients])

    return left
