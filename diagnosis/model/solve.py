"""The linear model solved: coefficients, noise levels and amplitudes of the unknown in turn, and the evidence."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.axis_system import Amplitudes, AxisSystem
from drivetwin.diagnosis.model.beside import Inner, Products, farther
from drivetwin.diagnosis.model.prior import Prior
from drivetwin.foundation.cached import cached_property

Array = NDArray[np.float64]
Index = NDArray[np.intp]

LEVELS = 4
"""Times that coefficients and noise levels are found in turn."""
TUNED = 7
"""The same where amplitudes are found as well: the evidence is then a part of a nat from where it ends."""
CLOSE = 1e-3
"""Change of a level, and of an amplitude over what is usual, below which nothing is left to find."""


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


@dataclass(frozen=True)
class _FreeColumns:
    """Which of an axis's columns are free, `local`, and `into` which of the free coefficients they go."""

    local: Index
    into: Index

    @classmethod
    def of(cls, place: Index) -> _FreeColumns:
        """`place`: of each column of the axis among the free coefficients; -1 for one that is held."""
        local = np.flatnonzero(place >= 0)
        return cls(local, place[local])

    def add(self, reduced: Array, level: float, information: Array, right: Array) -> None:
        """Adds what the axis contributes to the normal equations of all axes."""
        information[self.into[:, None], self.into] += reduced[self.local[:, None], self.local] / level**2
        right[self.into] += reduced[self.local, -1] / level**2

    def square(self, reduced: Array, values: Array) -> float:
        """Sum of squares that the columns leave of the target with these values of the free coefficients."""
        vector = np.zeros(len(reduced))
        vector[self.local], vector[-1] = -values[self.into], 1.0
        return max(float(vector @ reduced @ vector), 0.0)


NONE_RESTS: Mapping[str, Resting] = MappingProxyType({})


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
    at = {axis: _FreeColumns.of(place[part.index]) for axis, part in parts.items()}
    told = whole.only(free)
    prior = told.base + told.near
    counts = {axis: own.colour.counts[kept[axis]] if kept else own.colour.counts for axis, own in axes.items()}
    count = {axis: float(each.sum()) for axis, each in counts.items()}
    moving = [axis for axis in axes if axis not in resting]
    amplitude, level = dict(amplitude), dict.fromkeys(axes, 1.0) | {axis: one.level for axis, one in resting.items()}
    inner = {axis: one.inner for axis, one in resting.items()}
    reduced = {axis: one.reduced for axis, one in resting.items()}
    at_rest = np.zeros((len(free), len(free))), np.zeros(len(free))
    for axis, one in resting.items():
        at[axis].add(one.reduced, one.level, *at_rest)
    values, information = np.zeros(len(free)), np.diag(prior)
    squares: dict[str, float] = {}
    turns, found, earlier = TUNED if tuned else LEVELS, False, dict[str, Array]()
    for turn in range(turns):
        information, right = (each.copy() for each in at_rest)
        information.flat[:: len(free) + 1] += prior
        for axis in moving:
            gram = axes[axis].gram if grams is None else grams[axis]
            inner[axis] = Inner.of(gram, amplitude[axis][axes[axis].component], level[axis])
            reduced[axis] = inner[axis].reduced(parts[axis])
            at[axis].add(reduced[axis], level[axis], information, right)
        values = _solve(information, right)
        squares = {axis: at[axis].square(reduced[axis], values) for axis in moving}
        if found or turn == turns - 1:
            break
        found, prior = True, told.precision(values)
        for axis in tuned:
            own, part = axes[axis], parts[axis]
            left = part.across[:, -1] - part.across[:, at[axis].local] @ values[at[axis].into]
            mean = inner[axis].mean(left)
            tuned_now = inner[axis].tuned(own.component, mean, amplitude[axis], own.misfit)
            there = bool(np.abs(tuned_now - amplitude[axis]).max(initial=0.0) < CLOSE * own.misfit)
            amplitude[axis] = tuned_now if there else _ahead(earlier, axis, amplitude[axis], tuned_now, own.misfit)
            found &= there
        louder = {axis: max(1.0, float(np.sqrt(squares[axis] / max(count[axis], 1.0)))) for axis in moving}
        found &= all(abs(louder[axis] - level[axis]) < CLOSE * level[axis] for axis in moving)
        level |= louder
    squares |= {axis: at[axis].square(one.reduced, values) for axis, one in resting.items()}
    evidence = -told.cost(values)
    for axis, own in axes.items():
        evidence -= own.colour.logarithm + count[axis] * np.log(level[axis]) + 0.5 * squares[axis] / level[axis] ** 2
        evidence -= inner[axis].logarithm + own.unlikely(amplitude[axis])
    evidence -= _volume(told, information)
    independent = sum(own.colour.independent for own in axes.values())
    evidence -= 0.5 * float(np.sum(told.base == 0.0)) * np.log(independent)
    coefficients = np.zeros(size)
    coefficients[free] = values
    return Fit(coefficients, level, amplitude, float(evidence), information, free)


def _volume(told: Prior, information: Array) -> float:
    """What the coefficients that have a prior cost, integrated out by Laplace's method [nats]."""
    bound = np.flatnonzero(told.base > 0.0)
    if not bound.size:
        return 0.0
    spread = 1.0 / np.sqrt(told.base[bound])
    return 0.5 * float(np.linalg.slogdet(information[np.ix_(bound, bound)] * np.outer(spread, spread))[1])


def _ahead(earlier: dict[str, Array], axis: str, last: Array, now: Array, misfit: float) -> Array:
    """Amplitudes of an axis as they are now; every second turn where these, the last and those `earlier` are bound for."""
    if axis in earlier:
        return farther(earlier.pop(axis), last, now, misfit)
    earlier[axis] = last
    return now


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
