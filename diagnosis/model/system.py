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
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from drivetwin.diagnosis.model.axis_system import Amplitudes, AxisSystem
from drivetwin.diagnosis.model.beside import Inner, Products
from drivetwin.diagnosis.model.prior import Prior
from drivetwin.diagnosis.model.projector import Projector
from drivetwin.diagnosis.model.solve import Fit, Resting, solved
from drivetwin.diagnosis.prepare.rows import Column
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.lately import OfSame

Array = NDArray[np.float64]
Index = NDArray[np.intp]

REMEMBERED = 3
"""Sets of columns of an axis whose products are remembered."""
FREEDOM = 4.0
"""Degrees of freedom of the t distribution of a stretch that was held out: what Lange, Little and Taylor (1989) recommend."""


@dataclass(frozen=True)
class Matrix:
    """Rows (N, k) of one axis: the columns that act on it, `index` (k - 1,) says which, and the target last."""

    rows: Array
    index: Index


def system_of(
    axes: Mapping[str, AxisSystem],
    columns: Sequence[Column],
    spreads: Array,
    freedom: float = np.inf,
    near: Array | None = None,
    known: OfSame | None = None,
) -> System:
    """The system of columns, whitened, with their priors, the unknown as large as it usually is; `near`: none by default.

    `known`: where products of the same columns are remembered: most trials change those of one axis.
    """
    near = np.zeros(len(columns)) if near is None else near
    known = known or OfSame()
    matrices, products = {}, {}
    for axis, own in axes.items():
        acting = [(k, column[axis]) for k, column in enumerate(columns) if axis in column]
        same = (own, *(each for pair in acting for each in pair))
        matrices[axis], products[axis] = known.get(same, partial(_matrix_of, axis, own, columns), REMEMBERED * len(axes))
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

    def whiten(self, column: Column) -> dict[str, Array]:
        """A column through the colour of each axis that it acts on."""
        return {axis: self.axes[axis].colour.whiten(rows) for axis, rows in column.items()}

    def fit(
        self, extra: Sequence[Column] = (), less: Column | None = None, held: frozenset[int] = frozenset(), near: float = 0.0
    ) -> Fit:
        """With further free columns, and `less` taken off the target; both whitened already. `held` columns are 0.

        `near`: of the further columns, as of the system's.
        """
        acted = self._acted_on(extra, less)
        parts = {axis: self._with(axis, extra, less) for axis in self.axes}
        return solved(self.axes, parts, self._prior(extra, near), held, self.amplitude, resting=self._others(acted))

    def fit_tuned(self, extra: Sequence[Column], less: Column | None, held: frozenset[int], near: float = 0.0) -> Fit:
        """The same with amplitudes where the evidence is highest, on axes that something acts on; on all where nothing does."""
        acted = self._acted_on(extra, less)
        parts = {axis: self._with(axis, extra, less) for axis in self.axes}
        return solved(self.axes, parts, self._prior(extra, near), held, self.amplitude, acted, resting=self._others(acted))

    def _acted_on(self, extra: Sequence[Column], less: Column | None) -> list[str]:
        """Axes on which further columns act; all where none does."""
        told = {axis for one in (*extra, *([less] if less is not None else [])) for axis in one}
        return [axis for axis in self.axes if axis in told] or list(self.axes)

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

    def strain_of(self, fit: Fit, number: int) -> float:
        """The same of one column."""
        return self._prior(()).only(np.array([number])).cost(fit.coefficients[[number]])

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

    def left_within(
        self, most: Mapping[int, float], extra: Sequence[Column], less: Column | None, held: frozenset[int], near: float
    ) -> dict[str, Array]:
        """`residual` of the fit with some of its own columns bounded, by number: their coefficients are at most so much."""
        while True:
            fit = self.fit(extra, less, held, near)
            far = [number for number in most.keys() - held if abs(fit.coefficients[number]) > most[number]]
            if not far:
                return self.residual(fit, extra, less)
            at_bounds = [(float(np.copysign(most[number], fit.coefficients[number])), self.columns[number]) for number in far]
            less, held = _sum_of([(1.0, less or {}), *at_bounds]), held.union(far)

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
                    count = float(own.colour.counts[rows].sum())
                    found[axis][block] = _log_density(left[rows], unknown, fit.level[axis], count)
        return found


def _log_density(left: Array, unknown: Array, level: float, n: float) -> float:
    """Of rows (k,) [nats] beside noise and an unknown that was not learned elsewhere: by its prior (Woodbury's identity).

    `unknown` (k, m): its columns, for coefficients of rms 1; `n`: as how many the rows count.

    A multivariate t distribution instead of a normal one: noise is not equally loud everywhere, and no stretch of time may
    outvote all others (Lange, Little, Taylor, Journal of the American Statistical Association 84(408), 1989).
    """
    ratio = level**2
    inner = unknown.T @ unknown + ratio * np.eye(unknown.shape[1])
    across = unknown.T @ left
    square = float(left @ left - across @ np.linalg.solve(inner, across)) if len(across) else float(left @ left)
    spread = float(np.linalg.slogdet(inner)[1]) - unknown.shape[1] * float(np.log(ratio))
    tail = gammaln(0.5 * (FREEDOM + n)) - gammaln(0.5 * FREEDOM) - 0.5 * n * np.log(0.5 * (FREEDOM - 2.0))
    tail -= 0.5 * (FREEDOM + n) * np.log1p(square / level**2 / (FREEDOM - 2.0))
    return float(tail - 0.5 * spread - n * np.log(level))


def _sum_of(parts: Sequence[tuple[float, Column]]) -> Column:
    """Columns, each so many times, as one."""
    axes = dict.fromkeys(axis for _, column in parts for axis in column)
    return {axis: np.sum([times * column[axis] for times, column in parts if axis in column], axis=0) for axis in axes}


def _matrix(axis: str, columns: Sequence[Column], first: int, target: Array) -> Matrix:
    """`first`: number of the first of the columns."""
    at = [k for k, column in enumerate(columns) if axis in column]
    rows = np.column_stack([*(columns[k][axis] for k in at), target])
    return Matrix(rows, np.array(at, dtype=np.intp) + first)


def _matrix_of(axis: str, own: AxisSystem, columns: Sequence[Column]) -> tuple[Matrix, Products]:
    matrix = _matrix(axis, columns, 0, own.target)
    return matrix, Products(matrix.rows.T @ matrix.rows, own.unknown.T @ matrix.rows, matrix.index)
