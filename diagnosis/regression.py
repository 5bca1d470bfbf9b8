"""Ridge regression of the gap on torques of causes, judged on folds that it did not see.

Weighted least squares over all axes; each axis has its own residual variance. A nominal parameter is held by a normal prior
about its nominal value (ridge). Folds are contiguous blocks, so that neighbours in time do not vouch for each other.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.comparison import FOLDS, Column, Comparison

Array = NDArray[np.float64]

FIRST_MEMORY = 10.0
"""Rows that count as one, before any residual is known."""
HARDLY_KNOWN = 100.0
"""Standard deviation of an effect's parameter that no data tell, in its own size."""
HELD = 1e30
"""Inverse variance of a coefficient that may not move."""


@dataclass(frozen=True)
class Fitted:
    """Coefficients (p,), what each fold's rows are left with on each axis when it is held back, and the prior's cost [nats]."""

    coefficients: Array
    held_out: Mapping[str, float]
    prior_cost: float


@dataclass(frozen=True)
class _Part:
    """One axis's rows of each fold: X'X (trials, folds, p, p), X'y (trials, folds, p), y'y (folds,).

    Of further columns where one acts; `trials` is 1 where all have the same.
    """

    gram: Array
    right: Array
    square: Array

    def left(self, beside: Array) -> Array:
        """Sum over folds of |y - X b|² (trials,), where each fold of a trial has its own b, (trials, folds, p or more)."""
        b = beside[..., : self.right.shape[-1]]
        explained = np.einsum("tfp,tfp->tf", b, 2.0 * self.right - np.einsum("tfpq,tfq->tfp", self.gram, b))
        return np.asarray(np.maximum(self.square - explained, 0.0).sum(axis=1))

    def beside(self, cross: Array, own: Array, goal: Array) -> _Part:
        """With m further columns Z of each trial: X'Z (trials, folds, p, m), Z'Z (.., m, m), Z'y (.., m)."""
        gram, right = (np.broadcast_to(each, (len(cross), *each.shape[1:])) for each in (self.gram, self.right))
        above = np.concatenate([gram, cross], axis=3)
        below = np.concatenate([cross.swapaxes(2, 3), own], axis=3)
        return _Part(np.concatenate([above, below], axis=2), np.concatenate([right, goal], axis=2), self.square)


class Regression:
    """Columns that every hypothesis has, with their priors; further columns are tried beside them."""

    def __init__(
        self,
        comparison: Comparison,
        columns: Sequence[Column],
        spreads: Sequence[float],
        target: Column,
        scale: Mapping[str, float],
        floor: Mapping[str, float],
        stands_for: Mapping[tuple[str, str], frozenset[int]],
    ) -> None:
        """`spreads` (p,): standard deviation of each coefficient about 0, inf for a free one. `scale`: residual rms of each
        axis times the square root of the rows that count as one, `floor`: what is too little to tell [N·m or N].
        `stands_for`: columns that an effect on an axis takes the place of, by number."""
        self.axes = comparison.simulation.axes
        self.folds = comparison.folds
        self.scale = dict(scale)
        self.floor = dict(floor)
        self.stands_for = dict(stands_for)
        self.spreads = np.asarray(spreads, dtype=np.float64)
        self.matrix = {axis: _matrix(columns, axis, len(target[axis])) for axis in self.axes}
        self.target = dict(target)
        self.rows = {axis: len(target[axis]) for axis in self.axes}
        self._gram = {axis: self._folded(axis, self.matrix[axis], self.matrix[axis]) for axis in self.axes}
        self._right = {axis: self._folded(axis, self.matrix[axis], self.target[axis][:, None])[:, :, 0] for axis in self.axes}
        self._square = {axis: self._folded_square(axis, self.target[axis]) for axis in self.axes}

    def fit(self, columns: Sequence[Column] = (), target: Column | None = None, held: frozenset[int] = frozenset()) -> Fitted:
        """With further free columns, for a target that differs from the usual one on some axes; `held` coefficients are 0."""
        parts = {axis: self._part(axis, columns, target) for axis in self.axes}
        return self._solve(parts, len(columns), held)[0]

    def fit_each(self, axis: str, trials: Sequence[Sequence[Array]], held: frozenset[int] = frozenset()) -> list[Fitted]:
        """`fit` with each of several trials, whose columns (N,) act on one axis: many small ones at once."""
        sizes = [len(columns) for columns in trials]
        if not trials:
            return []
        extra = np.column_stack([column for columns in trials for column in columns])
        cross, own = self._folded(axis, self.matrix[axis], extra), self._folded(axis, extra, extra)
        goal = self._folded(axis, extra, self.target[axis][:, None])[:, :, 0]
        begins = np.cumsum([0, *sizes[:-1]])
        plain = {each: self._part(each, (), None) for each in self.axes}
        found: dict[int, Fitted] = {}
        for size in sorted(set(sizes)):
            numbers = [number for number, each in enumerate(sizes) if each == size]
            picks = begins[numbers][:, None] + np.arange(size)
            part = plain[axis].beside(
                np.moveaxis(cross[:, :, picks], 2, 0),
                np.moveaxis(own[:, picks[:, :, None], picks[:, None, :]], 1, 0),
                np.moveaxis(goal[:, picks], 1, 0),
            )
            found.update(zip(numbers, self._solve({**plain, axis: part}, size, held), strict=True))
        return [found[number] for number in range(len(trials))]

    def _part(self, axis: str, columns: Sequence[Column], target: Column | None) -> _Part:
        """What an axis has a say in: without the further columns, where none of them acts on it."""
        right, square, y = self._right[axis], self._square[axis], self.target[axis]
        if target is not None and axis in target:
            y = target[axis]
            right, square = self._folded(axis, self.matrix[axis], y[:, None])[:, :, 0], self._folded_square(axis, y)
        part = _Part(self._gram[axis][None], right[None], square)
        if not any(axis in column for column in columns):
            return part
        extra = _matrix(columns, axis, self.rows[axis])
        cross, own = self._folded(axis, self.matrix[axis], extra), self._folded(axis, extra, extra)
        return part.beside(cross[None], own[None], self._folded(axis, extra, y[:, None])[None, :, :, 0])

    def rescaled(self, scale: Mapping[str, float]) -> Regression:
        """The same rows and columns, weighted by other scales."""
        changed = copy.copy(self)
        changed.scale = dict(scale)
        return changed

    def standing_for(self, effect: str, axis: str, columns: frozenset[int]) -> Regression:
        """The same, with an effect on an axis taking the place of some columns."""
        changed = copy.copy(self)
        changed.stands_for = {**self.stands_for, (effect, axis): columns}
        return changed

    def replaced_by(self, effect: str, axis: str) -> frozenset[int]:
        """Columns that are held at 0 beside an effect, by number."""
        return self.stands_for.get((effect, axis), frozenset())

    def evidence(self, fitted: Fitted, rows_as_one: Mapping[str, float] | None = None) -> float:
        """Nats: each axis's held-out error by as many rows as count, what is below the floor counts little; less the prior."""
        told = -fitted.prior_cost
        for axis, rows in self.rows.items():
            if rows:
                independent = rows / (rows_as_one[axis] if rows_as_one else FIRST_MEMORY)
                told -= 0.5 * independent * float(np.log(fitted.held_out[axis] / rows + self.floor[axis] ** 2))
        return told

    def residual(self, fitted: Fitted, columns: Sequence[Column] = (), target: Column | None = None) -> dict[str, Array]:
        """What is left on the rows of each axis, (N,)."""
        found = {}
        for axis in self.axes:
            y = target[axis] if target is not None and axis in target else self.target[axis]
            extra = _matrix(columns, axis, self.rows[axis])
            found[axis] = y - np.hstack([self.matrix[axis], extra]) @ fitted.coefficients
        return found

    def _solve(self, parts: Mapping[str, _Part], more: int, held: frozenset[int]) -> list[Fitted]:
        """Of each trial; `more` columns stand beside those that every hypothesis has."""
        ridge = np.concatenate([1.0 / self.spreads**2, np.zeros(more)])
        ridge[list(held)] = HELD
        size, trials = len(ridge), max(len(part.right) for part in parts.values())
        gram, right = np.zeros((trials, FOLDS, size, size)), np.zeros((trials, FOLDS, size))
        for axis, part in parts.items():
            weight, own = 1.0 / self.scale[axis] ** 2, part.right.shape[-1]
            gram[..., :own, :own] += weight * part.gram
            right[..., :own] += weight * part.right
        whole, goal = gram.sum(axis=1), right.sum(axis=1)
        coefficients = _solved(whole, goal, ridge)
        beside = _solved(whole[:, None] - gram, goal[:, None] - right, ridge)
        left = {axis: part.left(beside).tolist() for axis, part in parts.items()}
        coefficients[:, list(held)] = 0.0
        prior = 0.5 * np.sum((coefficients[:, : len(self.spreads)] / self.spreads) ** 2, axis=1)
        return [
            Fitted(coefficients[trial], {axis: each[trial] for axis, each in left.items()}, float(prior[trial]))
            for trial in range(trials)
        ]

    def _folded(self, axis: str, left: Array, right: Array) -> Array:
        return np.stack([left[rows].T @ right[rows] for rows in self.folds[axis]])

    def _folded_square(self, axis: str, values: Array) -> Array:
        return np.array([float(values[rows] @ values[rows]) for rows in self.folds[axis]])


def covariance(regression: Regression, without_prior_from: int | None = None) -> Array:
    """Of the coefficients: rows weighted by residual and memory, priors included but for those from a number on."""
    size = len(regression.spreads)
    spreads = regression.spreads.copy()
    if without_prior_from is not None:
        spreads[without_prior_from:] = HARDLY_KNOWN
    gram = np.diag(1.0 / spreads**2)
    for axis in regression.axes:
        weighted = regression.matrix[axis] / regression.scale[axis]
        gram = gram + weighted.T @ weighted
    scale = np.sqrt(np.diag(gram))
    scale[scale == 0.0] = 1.0
    return np.asarray(np.linalg.inv(gram / np.outer(scale, scale) + 1e-12 * np.eye(size)) / np.outer(scale, scale))


def _matrix(columns: Sequence[Column], axis: str, rows: int) -> Array:
    if not columns:
        return np.zeros((rows, 0))
    return np.column_stack([column.get(axis, np.zeros(rows)) for column in columns])


def _solved(gram: Array, right: Array, ridge: Array) -> Array:
    """Solutions (..., p) of systems (..., p, p); scaled, so that columns of different units weigh alike in the numerics.

    A column of zeros gets the coefficient 0.
    """
    count = len(ridge)
    size = np.sqrt(np.diagonal(gram, axis1=-2, axis2=-1) + ridge)
    size[size == 0.0] = 1.0
    scaled = gram / (size[..., :, None] * size[..., None, :])
    scaled[..., range(count), range(count)] += ridge / size**2
    scaled[..., range(count), range(count)] += 1e-10
    return np.asarray(np.linalg.solve(scaled, (right / size)[..., None])[..., 0] / size)
