"""One linear model over all axes: nominal parameters with their priors, effects, the smooth unknown and coloured noise.

y = X b + Z c + U u + e.  b ~ N(0, diag spreads²) are nominal parameters, c are free (effects, linearised where they are), u
is the unknown of each axis, N(0, misfit²), e coloured noise whose level is fitted, axis by axis. u is integrated out exactly
(Schur complement), b by Laplace; c counts by the Bayesian information criterion (Schwarz, Annals of Statistics 6(2), 1978)
with as many rows as the colour leaves independent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.model.colour import Colour
from diagnosis.prepare.rows import Column

Array = NDArray[np.float64]

LEVELS = 3
"""Times that coefficients and noise levels are found in turn."""


@dataclass(frozen=True)
class AxisSystem:
    """One axis, whitened: the unknown's columns (N, m), rotated so that they do not overlap, their squares (m,), and y (N,)."""

    colour: Colour
    unknown: Array
    squares: Array
    misfit: float
    target: Array
    blocks: NDArray[np.intp]


@dataclass(frozen=True)
class Products:
    """Of one axis: inner products of columns and target, A'A (q, q), and with the unknown's columns, U'A (m, q)."""

    gram: Array
    across: Array


@dataclass(frozen=True)
class Fit:
    """Coefficients (q,), their covariance (q, q), noise level of each axis, and log evidence [nats]."""

    coefficients: Array
    covariance: Array
    level: Mapping[str, float]
    evidence: float


def axis_system(colour: Colour, unknown: Array, misfit: float, target: Array, blocks: NDArray[np.intp]) -> AxisSystem:
    """`unknown` (N, m): its columns as they are felt, for coefficients of rms `misfit` [N·m or N]."""
    columns = colour.whiten(unknown)
    values, vectors = np.linalg.eigh(columns.T @ columns) if columns.shape[1] else (np.zeros(0), np.zeros((0, 0)))
    keep = values > 1e-9 * max(float(values.max(initial=0.0)), 1e-300)
    return AxisSystem(colour, columns @ vectors[:, keep], values[keep], misfit, colour.whiten(target), blocks)


@dataclass(frozen=True)
class System:
    """Columns that a set of effects has, whitened, with their priors: `spreads` (p,), inf for a free one."""

    axes: Mapping[str, AxisSystem]
    columns: Sequence[Column]
    spreads: Array
    _whitened: dict[str, Array] = field(init=False, default_factory=dict)
    _products: dict[str, Products] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        for axis, own in self.axes.items():
            none = np.zeros(len(own.target))
            self._whitened[axis] = np.column_stack([*(column.get(axis, none) for column in self.columns), own.target])
            self._products[axis] = _products(own, self._whitened[axis])

    @property
    def rows(self) -> int:
        """Of all axes."""
        return sum(len(own.target) for own in self.axes.values())

    def whiten(self, column: Column) -> dict[str, Array]:
        """A column through the colour of each axis that it acts on."""
        return {axis: self.axes[axis].colour.whiten(rows) for axis, rows in column.items()}

    def fit(self, extra: Sequence[Column] = (), less: Column | None = None, held: frozenset[int] = frozenset()) -> Fit:
        """With further free columns, and `less` taken off the target; both whitened already. `held` columns are 0."""
        parts = {axis: self._with(axis, extra, less) for axis in self.axes}
        spreads = np.concatenate([self.spreads, np.full(len(extra), np.inf)])
        return solved(self.axes, parts, spreads, held)

    def strain(self, fit: Fit) -> float:
        """What the priors of the columns cost [nats]: how far nominal parameters are off."""
        return 0.5 * float(np.sum((fit.coefficients[: len(self.spreads)] / self.spreads) ** 2))

    def _with(self, axis: str, extra: Sequence[Column], less: Column | None) -> Products:
        known = self._products[axis]
        touched = any(axis in column for column in extra) or (less is not None and axis in less)
        count = len(self.axes[axis].target)
        if not extra and not touched:
            return known
        p = len(self.columns)
        q = p + len(extra) + 1
        gram, across = np.zeros((q, q)), np.zeros((len(known.across), q))
        base = [*range(p), q - 1]
        gram[np.ix_(base, base)], across[:, base] = known.gram, known.across
        if not touched:
            return Products(gram, across)
        own, whitened = self.axes[axis], self._whitened[axis]
        further = np.column_stack([column.get(axis, np.zeros(count)) for column in extra]) if extra else np.zeros((count, 0))
        target = whitened[:, -1] - (less[axis] if less is not None and axis in less else 0.0)
        new = np.column_stack([further, target])
        at = [*range(p, q - 1), q - 1]
        cross = whitened[:, :p].T @ new
        gram[np.ix_(range(p), at)], gram[np.ix_(at, range(p))] = cross, cross.T
        gram[np.ix_(at, at)] = new.T @ new
        across[:, at] = own.unknown.T @ new
        return Products(gram, across)

    def projector(self, axes: Sequence[str], level: Mapping[str, float], held: frozenset[int]) -> Projector:
        """Takes off some axes' rows what the columns, with their priors, and the unknown explain of them."""
        own = [axis for axis in self.axes if axis in axes]
        keep = [k for k in range(len(self.columns)) if k not in held]
        return Projector(
            {axis: self.axes[axis] for axis in own},
            {axis: self._whitened[axis][:, keep] for axis in own},
            self.spreads[keep],
            {axis: level[axis] for axis in own},
        )

    def residual(self, fit: Fit, extra: Sequence[Column] = (), less: Column | None = None) -> dict[str, Array]:
        """Whitened rows that the columns leave, unknown included in what is left, by axis."""
        found = {}
        for axis in self.axes:
            rows = self._whitened[axis]
            left = rows[:, -1] - rows[:, :-1] @ fit.coefficients[: len(self.columns)]
            for column, value in zip(extra, fit.coefficients[len(self.columns) :], strict=True):
                left = left - column.get(axis, 0.0) * value
            found[axis] = left - (less[axis] if less is not None and axis in less else 0.0)
        return found

    def unknown_of(self, axis: str, left: Array, level: float) -> Array:
        """Mean of the unknown's torque (N,), whitened, given what else leaves of the rows."""
        own = self.axes[axis]
        return own.unknown @ ((own.unknown.T @ left) / (own.squares + (level / own.misfit) ** 2))

    def held_out(self, fold_of_block: Mapping[str, NDArray[np.intp]], folds: int, extra: Sequence[Column], less: Column | None,
                 held: frozenset[int] = frozenset()) -> dict[str, Array]:  # fmt: skip
        """Log density [nats] of each axis's blocks, (B,), each predicted from the folds that it is not in.

        The unknown is not learned from these folds: a set is judged by what it names.
        """
        whole, matrices = {}, {}
        count = {axis: len(own.target) for axis, own in self.axes.items()}
        p = len(self.columns)
        for axis, own in self.axes.items():
            further = [column.get(axis, np.zeros(count[axis])) for column in extra]
            rows = self._whitened[axis]
            target = rows[:, -1] - (less[axis] if less is not None and axis in less else 0.0)
            matrices[axis] = (
                np.column_stack([rows[:, :p], *further, target]) if further else np.column_stack([rows[:, :p], target])
            )
            whole[axis] = _products(own, matrices[axis])
        spreads = np.concatenate([self.spreads, np.full(len(extra), np.inf)])
        found = {axis: np.zeros(int(own.blocks.max(initial=-1)) + 1) for axis, own in self.axes.items()}
        for fold in range(folds):
            parts, squares, masks, grams = {}, {}, {}, {}
            for axis, own in self.axes.items():
                masks[axis] = fold_of_block[axis][own.blocks] == fold
                a, u = matrices[axis][masks[axis]], own.unknown[masks[axis]]
                parts[axis] = Products(whole[axis].gram - a.T @ a, whole[axis].across - u.T @ a)
                grams[axis] = np.diag(own.squares) - u.T @ u
                squares[axis] = own
            fit = solved(self.axes, parts, spreads, held, grams, {axis: ~mask for axis, mask in masks.items()})
            for axis, own in self.axes.items():
                mask = masks[axis]
                if not mask.any():
                    continue
                left = matrices[axis] @ np.append(-fit.coefficients, 1.0)
                for block in np.unique(own.blocks[mask]):
                    rows = own.blocks == block
                    found[axis][block] = _log_density(left[rows], own.unknown[rows], fit.level[axis], own.misfit)
        return found


def _log_density(left: Array, unknown: Array, level: float, misfit: float) -> float:
    """Of rows (n,) [nats] beside noise and an unknown that was not learned elsewhere: by its prior (Woodbury's identity)."""
    ratio = (level / misfit) ** 2
    inner = unknown.T @ unknown + ratio * np.eye(unknown.shape[1])
    across = unknown.T @ left
    square = float(left @ left - across @ np.linalg.solve(inner, across)) if len(across) else float(left @ left)
    spread = float(np.linalg.slogdet(inner)[1]) - unknown.shape[1] * float(np.log(ratio))
    return float(-0.5 * (square / level**2 + spread) - len(left) * np.log(level))


@dataclass(frozen=True)
class Projector:
    """Least squares with the columns and the unknown taken out: what a local search for an effect minimises."""

    axes: Mapping[str, AxisSystem]
    columns: Mapping[str, Array]
    spreads: Array
    level: Mapping[str, float]

    def __post_init__(self) -> None:
        size = len(self.spreads)
        information = np.diag(1.0 / self.spreads**2)
        for axis, own in self.axes.items():
            information += self._inner(axis, own, self.columns[axis], self.columns[axis])
        scale = _scale(information)
        inverse = np.linalg.inv(information / np.outer(scale, scale) + 1e-10 * np.eye(size)) / np.outer(scale, scale)
        object.__setattr__(self, "_inverse", inverse)

    def _inner(self, axis: str, own: AxisSystem, left: Array, right: Array) -> Array:
        shrink = 1.0 / (own.squares + (self.level[axis] / own.misfit) ** 2)
        through = (own.unknown.T @ left).T * shrink @ (own.unknown.T @ right)
        return np.asarray((left.T @ right - through) / self.level[axis] ** 2)

    def left(self, rows: Mapping[str, Array]) -> Array:
        """Whitened rows (N,) of each axis, in units of the noise, less what is explained; all axes one after the other.

        The unknown is taken off by half of what its prior lets through, so that the sum of squares is that of the evidence.
        """
        names = list(self.axes)
        right = sum(self._inner(axis, self.axes[axis], self.columns[axis], rows[axis][:, None])[:, 0] for axis in names)
        b = self._inverse @ right  # type: ignore[attr-defined]
        parts = []
        for axis in names:
            own = self.axes[axis]
            rest = rows[axis] - self.columns[axis] @ b
            ratio = (self.level[axis] / own.misfit) ** 2
            gain = 1.0 - np.sqrt(ratio / (own.squares + ratio))
            amount = own.unknown.T @ rest
            parts.append((rest - own.unknown @ (gain * amount / np.maximum(own.squares, 1e-300))) / self.level[axis])
        return np.concatenate([*parts, b / self.spreads])


def _products(own: AxisSystem, columns: Array) -> Products:
    return Products(columns.T @ columns, own.unknown.T @ columns)


def solved(
    axes: Mapping[str, AxisSystem],
    parts: Mapping[str, Products],
    spreads: Array,
    held: frozenset[int],
    grams: Mapping[str, Array] | None = None,
    kept: Mapping[str, NDArray[np.bool_]] | None = None,
) -> Fit:
    """Coefficients and noise levels in turn, and the evidence; `grams` of the unknown's columns where rows are held out."""
    size = len(spreads)
    free = np.array([k for k in range(size) if k not in held], dtype=np.intp)
    prior = 1.0 / spreads[free] ** 2
    count = {axis: float(kept[axis].sum() if kept else len(own.target)) for axis, own in axes.items()}
    level = dict.fromkeys(axes, 1.0)
    values, information = np.zeros(len(free)), np.diag(prior)
    squares: dict[str, float] = {}
    rotated = {axis: _rotated(grams[axis], parts[axis].across) for axis in axes} if grams else {}
    for turn in range(LEVELS):
        information, right, reduced = np.diag(prior).astype(float), np.zeros(len(free)), {}
        for axis, own in axes.items():
            part = parts[axis]
            roots, across = rotated[axis] if grams else (own.squares, part.across)
            shrink = 1.0 / (roots + (level[axis] / own.misfit) ** 2)
            reduced[axis] = part.gram - (across.T * shrink) @ across
            information += reduced[axis][np.ix_(free, free)] / level[axis] ** 2
            right += reduced[axis][free, -1] / level[axis] ** 2
        values = _solve(information, right)
        vector = np.zeros(size + 1)
        vector[free], vector[-1] = -values, 1.0
        squares = {axis: max(float(vector @ reduced[axis] @ vector), 0.0) for axis in axes}
        if turn < LEVELS - 1:
            level = {axis: max(1.0, float(np.sqrt(squares[axis] / max(count[axis], 1.0)))) for axis in axes}
    evidence = -0.5 * float(np.sum(values**2 * prior))
    for axis, own in axes.items():
        roots = rotated[axis][0] if grams else own.squares
        evidence -= own.colour.logarithm + count[axis] * np.log(level[axis]) + 0.5 * squares[axis] / level[axis] ** 2
        evidence -= 0.5 * float(np.sum(np.log1p(np.maximum(roots, 0.0) * (own.misfit / level[axis]) ** 2)))
    bound = np.flatnonzero(prior > 0.0)
    if bound.size:
        spread = 1.0 / np.sqrt(prior[bound])
        inner = information[np.ix_(bound, bound)] * np.outer(spread, spread)
        evidence -= 0.5 * float(np.linalg.slogdet(inner)[1])
    independent = sum(own.colour.independent for own in axes.values())
    evidence -= 0.5 * float(np.sum(prior == 0.0)) * np.log(independent)
    coefficients, covariance = np.zeros(size), np.zeros((size, size))
    coefficients[free] = values
    covariance[np.ix_(free, free)] = inverse_of(information)
    return Fit(coefficients, covariance, level, float(evidence))


def _rotated(gram: Array, across: Array) -> tuple[Array, Array]:
    values, vectors = np.linalg.eigh(gram)
    return np.maximum(values, 0.0), vectors.T @ across


def _solve(information: Array, right: Array) -> Array:
    scale = _scale(information)
    scaled = information / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))
    return np.asarray(np.linalg.solve(scaled, right / scale) / scale)


def inverse_of(information: Array) -> Array:
    """Of a matrix (q, q), scaled, so that columns of different units weigh alike in the numerics."""
    scale = _scale(information)
    return np.asarray(np.linalg.inv(information / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))) / np.outer(scale, scale))


def _scale(information: Array) -> Array:
    """Of each coefficient, so that columns of different units weigh alike in the numerics; 1 for one that nothing tells."""
    scale = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale[scale < 1e-100] = 1.0
    return scale
