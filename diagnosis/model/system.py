"""One linear model over all axes: nominal parameters with their priors, effects, the smooth unknown and coloured noise.

y = X b + Z c + U u + e.  b are nominal parameters, of a t distribution about 0 with scales `spreads`: most are off by little,
some by much (Lange, Little, Taylor 1989, by weights of their priors). c are free (effects, linearised where they are), u is the
unknown of each axis, N(0, amplitude²) in each of its components, e coloured noise whose level is fitted, axis by axis. u
is integrated out exactly (Schur complement), b by Laplace; c counts by the Bayesian information criterion (Schwarz, Annals of
Statistics 6(2), 1978) with as many rows as the colour leaves independent. The amplitudes are where the evidence is highest
(MacKay, Neural Computation 4(3), 1992): a set that names what is there needs a smaller unknown, and gains by it. Their prior
is exponential, which penalises what the model does not need (Simpson et al., Statistical Science 32(1), 2017, sec. 3).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from drivetwin.diagnosis.model.beside import Inner, Products
from drivetwin.diagnosis.model.colour import Colour
from drivetwin.diagnosis.model.prior import Prior
from drivetwin.diagnosis.prepare.rows import Column

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FREEDOM = 4.0
"""Degrees of freedom of the t distribution of a stretch that was held out: what Lange, Little and Taylor (1989) recommend."""
LEVELS = 4
"""Times that coefficients and noise levels are found in turn."""
TUNED = 10
"""The same where amplitudes are found as well."""
CLOSE = 1e-3
"""Change of a level, and of an amplitude over what is usual, below which nothing is left to find."""

NONE_RESTS: Mapping[str, Resting] = MappingProxyType({})

Amplitudes = Mapping[str, Array]
"""Of each axis, of each component of its unknown (K,) [N·m or N]."""


@dataclass(frozen=True)
class AxisSystem:
    """One axis, whitened: the unknown's columns (N, m), their products (m, m), the component (m,) of each, and y (N,).

    `misfit`: what amplitudes usually are [N·m or N].
    """

    colour: Colour
    unknown: Array
    gram: Array
    component: Index
    misfit: float
    target: Array
    blocks: Index

    @property
    def usual(self) -> Array:
        """Amplitudes (K,) as they usually are."""
        return np.full(int(self.component.max(initial=-1)) + 1, self.misfit)

    def unlikely(self, amplitude: Array) -> float:
        """How rare amplitudes (K,) are [nats]: exponential."""
        return float(np.sum(amplitude)) / self.misfit


@dataclass(frozen=True)
class Matrix:
    """Rows (N, k) of one axis: the columns that act on it, `index` (k - 1,) says which, and the target last."""

    rows: Array
    index: Index


@dataclass(frozen=True)
class Resting:
    """One axis beside others on which something is tried: its noise level, its unknown, and products with that taken out.

    Its coefficients are still found with all others. That its level would move with them is of second order, for the evidence
    is highest there.
    """

    level: float
    inner: Inner
    reduced: Array


@dataclass(frozen=True)
class Fit:
    """Coefficients (q,), noise level and amplitudes of each axis, and log evidence [nats].

    `information` (f, f): inverse covariance of the f coefficients that are not held, which are `free`.
    """

    coefficients: Array
    level: Mapping[str, float]
    amplitude: Amplitudes
    evidence: float
    information: Array
    free: Index

    @cached_property
    def covariance(self) -> Array:
        """Of the coefficients (q, q): 0 for those that are held. Few of the fits of a search are asked for it."""
        covariance = np.zeros((len(self.coefficients), len(self.coefficients)))
        covariance[np.ix_(self.free, self.free)] = inverse_of(self.information)
        return covariance


def axis_system(colour: Colour, unknown: Array, component: Index, misfit: float, target: Array, blocks: Index) -> AxisSystem:
    """`unknown` (N, m): its columns as they are felt, for coefficients of rms `misfit` [N·m or N]; the component of each."""
    columns = colour.whiten(unknown)
    return AxisSystem(colour, columns, columns.T @ columns, component, misfit, colour.whiten(target), blocks)


def system_of(
    axes: Mapping[str, AxisSystem],
    columns: Sequence[Column],
    spreads: Array,
    freedom: float = np.inf,
    near: Array | None = None,
) -> System:
    """The system of columns, whitened, with their priors, the unknown as large as it usually is; `near`: none by default."""
    near = np.zeros(len(columns)) if near is None else near
    matrices = {axis: _matrix(axis, columns, 0, own.target) for axis, own in axes.items()}
    products = {axis: _products(own, matrices[axis]) for axis, own in axes.items()}
    return System(axes, columns, spreads, {axis: own.usual for axis, own in axes.items()}, matrices, products, freedom, near)


@dataclass(frozen=True)
class System:
    """Columns that a set of effects has, whitened, with their priors: `spreads` (p,), inf for a free one."""

    axes: Mapping[str, AxisSystem]
    columns: Sequence[Column]
    spreads: Array
    amplitude: Amplitudes
    matrices: Mapping[str, Matrix]
    products: Mapping[str, Products]
    freedom: float
    """Degrees of freedom of the nominal parameters' t distribution; infinite: they are normal."""
    near: Array
    """Of each column (p,), the inverse square of the step over which it holds, where it is a tangent; else 0."""

    def tuned(self, held: frozenset[int] = frozenset()) -> System:
        """The same with amplitudes where its evidence is highest."""
        return self.at(self.fit_tuned((), None, held).amplitude)

    def at(self, amplitude: Amplitudes) -> System:
        """The same with other amplitudes."""
        return replace(self, amplitude=amplitude)

    @property
    def rows(self) -> int:
        """Of all axes."""
        return sum(len(own.target) for own in self.axes.values())

    def whiten(self, column: Column) -> dict[str, Array]:
        """A column through the colour of each axis that it acts on."""
        return {axis: self.axes[axis].colour.whiten(rows) for axis, rows in column.items()}

    def fit(
        self, extra: Sequence[Column] = (), less: Column | None = None, held: frozenset[int] = frozenset(), near: float = 0.0
    ) -> Fit:
        """With further free columns, and `less` taken off the target; both whitened already. `held` columns are 0.

        `near`: of the further columns, as of the system's.
        """
        acted = _acted_on(extra, less) or set(self.axes)
        parts = {axis: self._with(axis, extra, less) for axis in self.axes}
        return solved(self.axes, parts, self._prior(extra, near), held, self.amplitude, resting=self._others(acted))

    def fit_tuned(self, extra: Sequence[Column], less: Column | None, held: frozenset[int], near: float = 0.0) -> Fit:
        """The same with amplitudes where the evidence is highest, on axes that something acts on; on all where nothing does."""
        acted = _acted_on(extra, less) or set(self.axes)
        parts = {axis: self._with(axis, extra, less) for axis in self.axes}
        return solved(self.axes, parts, self._prior(extra, near), held, self.amplitude, acted, resting=self._others(acted))

    def _others(self, acted: Collection[str]) -> dict[str, Resting]:
        """Axes on which nothing further acts, as they are without it."""
        return {axis: self._resting[axis] for axis in self.axes if axis not in acted}

    @cached_property
    def _resting(self) -> dict[str, Resting]:
        """Every axis as it is with these columns alone."""
        found = {}
        for axis, level in self.fit().level.items():
            own = self.axes[axis]
            inner = Inner.of(own.gram, self.amplitude[axis][own.component], level)
            found[axis] = Resting(level, inner, inner.reduced(self.products[axis]))
        return found

    def strain(self, fit: Fit) -> float:
        """What the priors of the columns cost [nats]: how far nominal parameters are off."""
        return self._prior(()).cost(fit.coefficients[: len(self.spreads)])

    def _prior(self, extra: Sequence[Column], near: float = 0.0) -> Prior:
        spreads = np.concatenate([self.spreads, np.full(len(extra), np.inf)])
        return Prior(1.0 / spreads**2, self.freedom, np.concatenate([self.near, np.full(len(extra), near)]))

    def _further(self, axis: str, extra: Sequence[Column], less: Column | None) -> Matrix:
        """The further columns that act on an axis, and its target without what is taken off it."""
        target = self.axes[axis].target
        return _matrix(axis, extra, len(self.columns), target - less[axis] if less is not None and axis in less else target)

    def _with(self, axis: str, extra: Sequence[Column], less: Column | None) -> Products:
        known, further = self.products[axis], self._further(axis, extra, less)
        if not len(further.index) and (less is None or axis not in less):
            return known
        own, rows, new = self.axes[axis], self.matrices[axis].rows, further.rows
        p, q = len(known.index), new.shape[1]
        gram, across = np.empty((p + q, p + q)), np.empty((len(known.across), p + q))
        gram[:p, :p], across[:, :p] = known.gram[:p, :p], known.across[:, :p]
        cross = rows[:, :p].T @ new
        gram[:p, p:], gram[p:, :p] = cross, cross.T
        gram[p:, p:] = new.T @ new
        across[:, p:] = own.unknown.T @ new
        return Products(gram, across, np.concatenate([known.index, further.index]))

    def projector(self, axes: Sequence[str], fit: Fit, held: frozenset[int]) -> Projector:
        """Takes off some axes' rows what the columns, with their priors, and the unknown explain of them."""
        own = [axis for axis in self.axes if axis in axes]
        used = sorted({int(k) for axis in own for k in self.matrices[axis].index} - held)
        place = {k: at for at, k in enumerate(used)}
        columns, products = {}, {}
        for axis in own:
            keep = [at for at, k in enumerate(self.matrices[axis].index) if int(k) in place]
            index = np.array([place[int(k)] for k in self.matrices[axis].index[keep]], dtype=np.intp)
            known = self.products[axis]
            columns[axis] = self.matrices[axis].rows[:, keep]
            products[axis] = Products(known.gram[np.ix_(keep, keep)], known.across[:, keep], index)
        return Projector(
            {axis: self.axes[axis] for axis in own},
            columns,
            products,
            self._prior(()).scales(fit.coefficients[: len(self.spreads)])[used],
            {axis: fit.level[axis] for axis in own},
            self.amplitude,
        )

    def residual(self, fit: Fit, extra: Sequence[Column] = (), less: Column | None = None) -> dict[str, Array]:
        """Whitened rows that the columns leave, unknown included in what is left, by axis."""
        found = {}
        for axis in self.axes:
            own, further = self.matrices[axis], self._further(axis, extra, less)
            left = further.rows[:, -1] - own.rows[:, :-1] @ fit.coefficients[own.index]
            found[axis] = left - further.rows[:, :-1] @ fit.coefficients[further.index]
        return found

    def unknown_of(self, axis: str, left: Array, level: float) -> Array:
        """Mean of the unknown's torque (N,), whitened, given what else leaves of the rows."""
        own = self.axes[axis]
        inner = Inner.of(own.gram, self.amplitude[axis][own.component], level)
        return np.asarray(own.unknown @ inner.mean(own.unknown.T @ left))

    def held_out(self, fold_of_block: Mapping[str, Index], folds: int, extra: Sequence[Column], less: Column | None,
                 held: frozenset[int] = frozenset(), near: float = 0.0) -> dict[str, Array]:  # fmt: skip
        """Log density [nats] of each axis's blocks, (B,), each predicted from the folds that it is not in.

        The unknown is not learned from these folds: a set is judged by what it names.
        """
        whole, matrices = {}, {}
        amplitude = self.fit_tuned(extra, less, held, near).amplitude
        for axis in self.axes:
            known, further = self.matrices[axis], self._further(axis, extra, less)
            index = np.concatenate([known.index, further.index])
            matrices[axis] = Matrix(np.column_stack([known.rows[:, :-1], further.rows]), index)
            whole[axis] = self._with(axis, extra, less)
        found = {axis: np.zeros(int(own.blocks.max(initial=-1)) + 1) for axis, own in self.axes.items()}
        for fold in range(folds):
            parts, masks, grams = {}, {}, {}
            for axis, own in self.axes.items():
                masks[axis] = fold_of_block[axis][own.blocks] == fold
                a, u = matrices[axis].rows[masks[axis]], own.unknown[masks[axis]]
                parts[axis] = Products(whole[axis].gram - a.T @ a, whole[axis].across - u.T @ a, whole[axis].index)
                grams[axis] = own.gram - u.T @ u
            kept = {axis: ~mask for axis, mask in masks.items()}
            fit = solved(self.axes, parts, self._prior(extra, near), held, amplitude, (), grams, kept)
            for axis, own in self.axes.items():
                mask = masks[axis]
                if not mask.any():
                    continue
                left = matrices[axis].rows @ np.append(-fit.coefficients[matrices[axis].index], 1.0)
                for block in np.unique(own.blocks[mask]):
                    rows = own.blocks == block
                    unknown = own.unknown[rows] * amplitude[axis][own.component]
                    found[axis][block] = _log_density(left[rows], unknown, fit.level[axis])
        return found


def _log_density(left: Array, unknown: Array, level: float) -> float:
    """Of rows (n,) [nats] beside noise and an unknown that was not learned elsewhere: by its prior (Woodbury's identity).

    `unknown` (n, m): its columns, for coefficients of rms 1.

    A multivariate t distribution instead of a normal one: noise is not equally loud everywhere, and no stretch of time may
    outvote all others (Lange, Little, Taylor, Journal of the American Statistical Association 84(408), 1989).
    """
    ratio, n = level**2, len(left)
    inner = unknown.T @ unknown + ratio * np.eye(unknown.shape[1])
    across = unknown.T @ left
    square = float(left @ left - across @ np.linalg.solve(inner, across)) if len(across) else float(left @ left)
    spread = float(np.linalg.slogdet(inner)[1]) - unknown.shape[1] * float(np.log(ratio))
    tail = gammaln(0.5 * (FREEDOM + n)) - gammaln(0.5 * FREEDOM) - 0.5 * n * np.log(0.5 * (FREEDOM - 2.0))
    tail -= 0.5 * (FREEDOM + n) * np.log1p(square / level**2 / (FREEDOM - 2.0))
    return float(tail - 0.5 * spread - n * np.log(level))


@dataclass(frozen=True)
class Projector:
    """Least squares with the columns and the unknown taken out: what a local search for an effect minimises.

    `products` are those of `columns`, by axis: nothing of the size of the rows is computed twice.
    """

    axes: Mapping[str, AxisSystem]
    columns: Mapping[str, Array]
    products: Mapping[str, Products]
    spreads: Array
    level: Mapping[str, float]
    amplitude: Amplitudes

    @cached_property
    def _inverse(self) -> Array:
        information = np.diag(1.0 / self.spreads**2)
        for axis, part in self.products.items():
            information[np.ix_(part.index, part.index)] += self._inner[axis].reduced(part) / self.level[axis] ** 2
        return inverse_of(information)

    @cached_property
    def _inner(self) -> dict[str, Inner]:
        return {
            axis: Inner.of(own.gram, self.amplitude[axis][own.component], self.level[axis]) for axis, own in self.axes.items()
        }

    def left(self, rows: Mapping[str, Array]) -> Array:
        """Whitened rows (N,) or (N, k) of each axis, in units of the noise, less what is explained; axis after axis.

        Behind them what columns and unknown need, in units of their priors: the sum of squares is that of the evidence.
        """
        unknown = {axis: own.unknown.T @ rows[axis] for axis, own in self.axes.items()}
        right = np.zeros((len(self.spreads), *next(iter(rows.values())).shape[1:]))
        for axis, part in self.products.items():
            own_right = self.columns[axis].T @ rows[axis] - part.across.T @ self._inner[axis].mean(unknown[axis])
            right[part.index] += own_right / self.level[axis] ** 2
        b = self._inverse @ right
        parts, needed = [], []
        for axis, own in self.axes.items():
            part, own_b = self.products[axis], b[self.products[axis].index]
            inner = self._inner[axis]
            amount = inner.mean(unknown[axis] - part.across @ own_b)
            parts.append((rows[axis] - self.columns[axis] @ own_b - own.unknown @ amount) / self.level[axis])
            needed.append((amount.T / np.maximum(inner.roots, 1e-300)).T)
        return np.concatenate([*parts, *needed, (b.T / self.spreads).T])


def _acted_on(extra: Sequence[Column], less: Column | None) -> set[str]:
    """Axes on which further columns act."""
    return {axis for one in (*extra, *([less] if less is not None else [])) for axis in one}


def _matrix(axis: str, columns: Sequence[Column], first: int, target: Array) -> Matrix:
    """`first`: number of the first of the columns."""
    at = [k for k, column in enumerate(columns) if axis in column]
    rows = np.column_stack([*(columns[k][axis] for k in at), target])
    return Matrix(rows, np.array(at, dtype=np.intp) + first)


def _products(own: AxisSystem, matrix: Matrix) -> Products:
    return Products(matrix.rows.T @ matrix.rows, own.unknown.T @ matrix.rows, matrix.index)


def solved(
    axes: Mapping[str, AxisSystem],
    parts: Mapping[str, Products],
    whole: Prior,
    held: frozenset[int],
    amplitude: Amplitudes,
    tuned: Collection[str] = (),
    grams: Mapping[str, Array] | None = None,
    kept: Mapping[str, NDArray[np.bool_]] | None = None,
    resting: Mapping[str, Resting] = NONE_RESTS,
) -> Fit:
    """Coefficients, noise levels and the amplitudes of `tuned` axes in turn, and the evidence.

    `grams` of the unknown's columns where rows are held out; `resting`: axes whose level and amplitudes stay as they are.
    """
    size = len(whole.base)
    free = np.array([k for k in range(size) if k not in held], dtype=np.intp)
    place = np.full(size, -1, dtype=np.intp)
    place[free] = np.arange(len(free))
    local = {axis: np.flatnonzero(place[part.index] >= 0) for axis, part in parts.items()}
    into = {axis: place[part.index[local[axis]]] for axis, part in parts.items()}
    told = whole.only(free)
    prior = told.base + told.near
    count = {axis: float(kept[axis].sum() if kept else len(own.target)) for axis, own in axes.items()}
    moving = [axis for axis in axes if axis not in resting]
    amplitude, level = dict(amplitude), dict.fromkeys(axes, 1.0) | {axis: one.level for axis, one in resting.items()}
    values, information = np.zeros(len(free)), np.diag(prior)
    squares: dict[str, float] = {}
    inner = {axis: one.inner for axis, one in resting.items()}
    reduced = {axis: one.reduced for axis, one in resting.items()}
    turns, found = TUNED if tuned else LEVELS, False
    for turn in range(turns):
        information, right = np.diag(prior).astype(float), np.zeros(len(free))
        for axis in moving:
            gram = axes[axis].gram if grams is None else grams[axis]
            inner[axis] = Inner.of(gram, amplitude[axis][axes[axis].component], level[axis])
            reduced[axis] = inner[axis].reduced(parts[axis])
        for axis in axes:
            information[np.ix_(into[axis], into[axis])] += reduced[axis][np.ix_(local[axis], local[axis])] / level[axis] ** 2
            right[into[axis]] += reduced[axis][local[axis], -1] / level[axis] ** 2
        values = _solve(information, right)
        squares = {axis: _square(reduced[axis], local[axis], values[into[axis]]) for axis in axes}
        if found or turn == turns - 1:
            break
        found, prior = True, told.precision(values)
        for axis in tuned:
            own, part = axes[axis], parts[axis]
            left = part.across[:, -1] - part.across[:, local[axis]] @ values[into[axis]]
            mean = inner[axis].mean(left)
            tuned_now = inner[axis].tuned(own.component, mean, amplitude[axis], own.misfit)
            found &= bool(np.abs(tuned_now - amplitude[axis]).max(initial=0.0) < CLOSE * own.misfit)
            amplitude[axis] = tuned_now
        louder = {axis: max(1.0, float(np.sqrt(squares[axis] / max(count[axis], 1.0)))) for axis in moving}
        found &= all(abs(louder[axis] - level[axis]) < CLOSE * level[axis] for axis in moving)
        level |= louder
    evidence = -told.cost(values)
    for axis, own in axes.items():
        evidence -= own.colour.logarithm + count[axis] * np.log(level[axis]) + 0.5 * squares[axis] / level[axis] ** 2
        evidence -= inner[axis].logarithm + own.unlikely(amplitude[axis])
    bound = np.flatnonzero(told.base > 0.0)
    if bound.size:
        spread = 1.0 / np.sqrt(told.base[bound])
        inner_bound = information[np.ix_(bound, bound)] * np.outer(spread, spread)
        evidence -= 0.5 * float(np.linalg.slogdet(inner_bound)[1])
    independent = sum(own.colour.independent for own in axes.values())
    evidence -= 0.5 * float(np.sum(told.base == 0.0)) * np.log(independent)
    coefficients = np.zeros(size)
    coefficients[free] = values
    return Fit(coefficients, level, amplitude, float(evidence), information, free)


def _square(reduced: Array, local: Index, values: Array) -> float:
    """Sum of squares that columns with some values leave of the target."""
    vector = np.zeros(len(reduced))
    vector[local], vector[-1] = -values, 1.0
    return max(float(vector @ reduced @ vector), 0.0)


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
