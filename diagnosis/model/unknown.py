"""The smooth unknown: what torque may lack beside named effects, as a Gaussian process over what it may go with.

It is orthogonal to what the model's own parameters cost: a wrong Coulomb friction is a smooth curve as well, and else neither
is told (Plumlee and Joseph, Statistica Sinica 28(2), 2018).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.prepare.run import AxisRun, Run
from drivetwin.diagnosis.prepare.spanned import orthonormal

Array = NDArray[np.float64]

KNOTS = 25
KEPT = 1e-3
"""Share of the largest eigenvalue of the kernel, below which a component is left out."""
SLOW = 0.02
"""Share of the top speed below which speeds count as one: a friction curve bends on a logarithmic scale above it."""


@dataclass(frozen=True)
class Component:
    """What the unknown may go with: columns (N, m) whose coefficients are standard normal at an rms of 1 N·m or N."""

    goes_with: str
    columns: Array


@dataclass(frozen=True)
class _Scale:
    """A quantity of an axis as a coordinate from 0 to 1, and what multiplies a curve over it."""

    goes_with: str
    at: Callable[[Run, AxisRun], Array]
    times: Callable[[AxisRun], Array]


def components(rows: Rows, axis: str, waves: float, absolute: bool, known: Array) -> list[Component]:
    """Curves over position, velocity, load and time, with and without the direction of motion; those that can be told.

    `known` (N, q): what the model's own parameters cost, to which they are orthogonal.

    Squared-exponential kernels (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, eq. 4.9) of length
    1 / `waves` of the range, on knots joined by straight lines. Over position only where it is `absolute`.
    """
    motion = rows.motion[axis]
    top = max(float(np.quantile(np.abs(motion.velocity), 0.999)), 1e-12)
    span = _span(motion.position)
    load = _span(motion.rigid_torque)
    time = _span(np.concatenate([run.axes[axis].motion.time for run in rows.runs]))
    scales = [
        _Scale("velocity", lambda _, own: _speed(own, top), _one),
        _Scale("direction", lambda _, own: _speed(own, top), _direction),
        _Scale("time", lambda _, own: _within(own.motion.time, time), _direction),
    ]
    if absolute:
        scales.append(_Scale("position", lambda _, own: _within(own.motion.position, span), _one))
        scales.append(_Scale("position", lambda _, own: _within(own.motion.position, span), _direction))
    if load[1] - load[0] > 0.02 * rows.size[axis]:
        scales.append(_Scale("load", lambda _, own: _within(own.motion.rigid_torque, load), _direction))
        scales.append(_Scale("load", lambda _, own: _within(own.motion.rigid_torque, load), _one))
    curves, basis = shapes(waves), orthonormal(known)
    parts = [(scale.goes_with, _columns(rows, axis, scale, curves)) for scale in scales]
    return [Component(goes_with, columns - basis @ (basis.T @ columns)) for goes_with, columns in parts]


def _columns(rows: Rows, axis: str, scale: _Scale, curves: Array) -> Array:
    knots = np.linspace(0.0, 1.0, KNOTS)
    parts = []
    for run in rows.runs:
        own = run.axes[axis]
        place, times = scale.at(run, own), scale.times(own)
        if scale.goes_with == "position" and axis in run.unplaced:
            times = np.zeros_like(times)
        parts.append([run.felt(own, np.interp(place, knots, curve) * times) for curve in curves.T])
    return np.column_stack([rows.picked(axis, [part[k] for part in parts]) for k in range(curves.shape[1])])


def shapes(waves: float, knots: int = KNOTS) -> Array:
    """Components (knots, m) of the kernel on even knots, largest first, each times its standard deviation."""
    at = np.linspace(0.0, 1.0, knots)
    kernel = np.exp(-0.5 * ((at[:, None] - at) * waves) ** 2)
    values, vectors = np.linalg.eigh(kernel)
    keep = values > KEPT * values[-1]
    return np.asarray((vectors[:, keep] * np.sqrt(values[keep]))[:, ::-1])


def _one(own: AxisRun) -> Array:
    return np.ones_like(own.motion.velocity)


def _direction(own: AxisRun) -> Array:
    return np.asarray(np.sign(own.motion.velocity))


def _speed(own: AxisRun, top: float) -> Array:
    return np.asarray(np.clip(np.log1p(np.abs(own.motion.velocity) / (SLOW * top)) / np.log1p(1.0 / SLOW), 0.0, 1.0))


def _span(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _within(values: Array, span: tuple[float, float]) -> Array:
    return np.asarray((values - span[0]) / max(span[1] - span[0], 1e-12))


def by_quantity(found: Mapping[str, float]) -> list[str]:
    """Quantities that a tenth of what goes with any goes with, most first."""
    whole = sum(found.values())
    return [name for name, energy in sorted(found.items(), key=lambda one: -one[1]) if whole > 0.0 and energy > 0.1 * whole]
