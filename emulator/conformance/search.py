"""A local search for an effect of one kind in a recording without noise: from its own starts, in its own sizes and bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from drivetwin.emulator.conformance.bench import Recorded
from drivetwin.emulator.effects import AxisEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]

TRIED = 6
"""Starts that are moved, the best by a linear fit."""
ENOUGH = 0.995
"""Of the energy explained, for no further start to be moved."""
_STEP = 1e-3
"""Of a parameter's own size, for differences."""


def composed(kind: type[AxisEffect], recorded: Recorded) -> list[AxisEffect]:
    """Every start of the kind with its coefficients by linear least squares, the one that explains most first."""
    found = []
    for start in kind.starts(recorded.motion, recorded.axis):
        members = [recorded.judged(member.predict(recorded.motion, recorded.axis)) for member in start.members]
        if not all(np.isfinite(member).all() and member.any() for member in members):
            continue
        coefficients = np.linalg.lstsq(np.column_stack(members), recorded.gap, rcond=None)[0].tolist()
        effect = start.compose(coefficients)
        if effect is not None:
            found.append((recorded.explained_by(effect), effect))
    return [effect for _, effect in sorted(found, key=lambda one: -one[0])]


def searched(kind: type[AxisEffect], recorded: Recorded) -> AxisEffect | None:
    """The best of what the local search makes of the nearest starts; None where no start makes an effect."""
    tried: list[AxisEffect] = []
    for effect in composed(kind, recorded)[:TRIED]:
        tried.append(_moved(effect, recorded))
        if recorded.explained_by(tried[-1]) > ENOUGH:
            break
    return max(tried, key=recorded.explained_by, default=None)


def _moved(effect: AxisEffect, recorded: Recorded) -> AxisEffect:
    """Least squares in a trust region (Branch, Coleman, Li 1999), each parameter in units of its size."""
    sizes, fixed = effect.sizes(recorded.motion, recorded.axis), effect.fixed(recorded.axis)
    free = [one for one in type(effect).parameters if one.name not in fixed]
    scale = np.array([sizes[one.name] for one in free])
    low, high = np.array([one.low for one in free]) / scale, np.array([one.high for one in free]) / scale

    def at(values: Array) -> AxisEffect:
        return replace(effect, **dict(zip((one.name for one in free), (values * scale).tolist(), strict=True)))

    def left(values: Array) -> Array:
        try:
            cost = at(values).predict(recorded.motion, recorded.axis)
        except UserError:
            return np.full_like(recorded.gap, 1e9)
        return recorded.gap - recorded.judged(cost)

    def slopes(values: Array) -> Array:
        """Differences to one side, away from a bound."""
        ways = np.where(values + _STEP <= high, _STEP, -_STEP)
        here = left(values)
        return np.column_stack([(left(values + way * unit) - here) / way for way, unit in _each(ways)])

    begin = np.clip([getattr(effect, one.name) for one in free] / scale, np.nextafter(low, np.inf), np.nextafter(high, -np.inf))
    return at(least_squares(left, begin, jac=slopes, bounds=(low, high), max_nfev=30, xtol=1e-6, ftol=1e-8).x)


def _each(ways: Array) -> Sequence[tuple[float, Array]]:
    return list(zip(ways.tolist(), np.eye(len(ways)), strict=True))
