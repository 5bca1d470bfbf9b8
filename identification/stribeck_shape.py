"""Searches for the shape of the Stribeck curve: its velocity and its exponent.

The regression is linear but for these two, which variable projection takes out (Golub and Pereyra 1973): for each trial
shape the linear parameters are solved for, and the shape with the least squares wins.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from drivetwin.identification.cross_validation import Blocks
from drivetwin.identification.regressors import Design, Stribeck, Term, column
from drivetwin.motion.moving import AxisSamples
from drivetwin.recording.recording import Samples

_VELOCITIES = 24
_EXPONENTS = 4
_TOP_SHARE = 0.5
_LEAST_SLOW_SHARE = 0.01
_STEP = 0.1
_TOLERANCE = 1e-4
"""Of the refined velocity and exponent, relative."""


@dataclass(frozen=True)
class Survey:
    """Trial `shapes` on a grid, the residual `energy` (k,) that each leaves and its `means` (b, k) over the blocks."""

    shapes: tuple[Stribeck, ...]
    energy: Samples
    means: Samples

    def best(self) -> Stribeck | None:
        """The shape of least squares; None where none has a positive rise."""
        return self.shapes[int(np.argmin(self.energy))] if self.energy.min() < self.energy.max() else None


def survey(design: Design, samples: Sequence[AxisSamples], exponents: tuple[float, float]) -> Survey | None:
    """Try geometric grids of velocity and exponent; None where the speeds do not reach over a factor.

    Velocities run from the speed below which 1 % of the motion lies to half the top speed [rad/s or m/s].
    """
    low, high = velocity_range(samples)
    if not 0 < low < high:
        return None
    projection, blocks = Projection(design), Blocks(design)
    shapes = tuple(
        Stribeck(float(velocity), float(exponent))
        for exponent in np.unique(np.geomspace(*exponents, _EXPONENTS))
        for velocity in np.geomspace(low, high, _VELOCITIES)
    )
    energy, means = [], []
    for shape in shapes:
        values = rise_column(samples, shape)
        energy.append(projection.energy(values))
        means.append(blocks.means(values))
    return Survey(shapes, np.array(energy), np.column_stack(means))


def rise_column(samples: Sequence[AxisSamples], shape: Stribeck) -> Samples:
    """d tau / d static_rise over all recordings (n,); 0 in recordings of which nothing is fitted."""
    return np.concatenate(
        [
            column(entry.motion, Term.STATIC_RISE, shape) if entry.fitted.any() else np.zeros_like(entry.motion.time)
            for entry in samples
        ]
    )


class Projection:
    """`design` solved for, so that only one more column is left to be judged."""

    def __init__(self, design: Design) -> None:
        self._rows = np.flatnonzero(design.weight > 0)
        self._root = np.sqrt(design.weight[self._rows])
        basis, _ = np.linalg.qr(design.matrix[self._rows] * self._root[:, None])
        self._across = np.ascontiguousarray(basis.T)
        self._rest = self._beside(design.target)
        self._energy = float(self._rest @ self._rest)

    def energy(self, values: Samples) -> float:
        """Residual energy with the column `values` (n,); that without it where its coefficient is not positive."""
        rest = self._beside(values)
        norm, product = float(rest @ rest), float(rest @ self._rest)
        gain = product**2 / norm if product > 0 and norm > 0 else 0.0
        return self._energy - gain

    def _beside(self, values: Samples) -> Samples:
        weighted = values.take(self._rows) * self._root
        return np.asarray(weighted - (self._across @ weighted) @ self._across, dtype=np.float64)


def best_shape(design: Design, samples: Sequence[AxisSamples], start: Stribeck, exponents: tuple[float, float]) -> Stribeck:
    """The shape of least squares near `start`, by a simplex in the logarithms, its exponent within `exponents`."""
    projection = Projection(design)

    def energy(logarithms: Samples) -> float:
        return projection.energy(rise_column(samples, _shape(logarithms)))

    bounds = np.log([velocity_range(samples), exponents])
    first = np.clip(np.log([start.velocity, start.exponent]), bounds[:, 0], bounds[:, 1])
    inwards = np.where(first + _STEP < bounds[:, 1], _STEP, -_STEP)
    found = minimize(
        energy,
        first,
        method="Nelder-Mead",
        bounds=[(float(low), float(high)) for low, high in bounds],
        options={
            "xatol": _TOLERANCE,
            "fatol": 1e-9 * energy(first),
            "maxfev": 200,
            "initial_simplex": first + np.vstack([np.zeros(2), np.diag(inwards)]),
        },
    )
    return _shape(found.x)


def at_exponent(design: Design, samples: Sequence[AxisSamples], near: Stribeck, exponent: float) -> Stribeck:
    """The velocity of least squares at a given exponent, searched for within a factor of four of that of `near`."""
    projection = Projection(design)

    def energy(log_velocity: float) -> float:
        return projection.energy(rise_column(samples, Stribeck(float(np.exp(log_velocity)), exponent)))

    low, high = velocity_range(samples)
    bounds = math.log(max(low, near.velocity / 4.0)), math.log(min(high, 4.0 * near.velocity))
    found = minimize_scalar(energy, bounds=bounds, method="bounded", options={"xatol": _TOLERANCE})
    return Stribeck(float(np.exp(found.x)), exponent)


def _shape(logarithms: Samples) -> Stribeck:
    return Stribeck(float(np.exp(logarithms[0])), float(np.exp(logarithms[1])))


def velocity_range(samples: Sequence[AxisSamples]) -> tuple[float, float]:
    """From the speed below which 1 % of the motion lies to half the top speed [rad/s or m/s]."""
    speed = np.concatenate([np.abs(entry.motion.velocity[entry.fitted]) for entry in samples])
    weight = np.concatenate([np.full(int(entry.fitted.sum()), entry.motion.period) for entry in samples])
    order = np.argsort(speed)
    share = np.cumsum(weight[order]) / weight.sum()
    return float(speed[order][np.searchsorted(share, _LEAST_SLOW_SHARE)]), _TOP_SHARE * float(speed.max())
