"""Does friction rise towards low speed? The Stribeck term, and what the data say about its exponent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from drivetwin.identification.covariance import Covariance, hac_covariance
from drivetwin.identification.cross_validation import Blocks, searched_gain
from drivetwin.identification.least_squares import Solution, share_beside, solve
from drivetwin.identification.regressors import (
    Design,
    Stribeck,
    Term,
    stribeck_exponent_column,
    stribeck_velocity_column,
)
from drivetwin.identification.settings import Settings
from drivetwin.identification.stribeck_shape import at_exponent, best_shape, rise_column, survey
from drivetwin.motion.moving import AxisSamples
from drivetwin.recording.recording import Samples

_DEGENERATE = 1e-4
"""Share of its norm that the exponent's column must keep beside the others for a covariance to be formed at all."""


@dataclass(frozen=True)
class Exponent:
    """What the data say of the exponent: its `interval`, at most the bounds of the settings, and whether they can tell.

    Where they cannot, the settings' exponent stands. `quantile`: of the normal distribution, at the interval's confidence.
    """

    interval: tuple[float, float]
    told: bool
    quantile: float


@dataclass(frozen=True)
class StribeckTest:
    """`gain`: share of the cross-validated residual energy of 0.5 s means that the term takes away; `statistic`: of the
    static rise over its standard error; `trials`: number of shapes that were tried, for which `p_value` is corrected."""

    real: bool
    gain: float
    statistic: float
    p_value: float
    trials: int
    stribeck: Stribeck | None
    exponent: Exponent | None


def with_stribeck(design: Design, samples: Sequence[AxisSamples], stribeck: Stribeck) -> Design:
    """`design` with the column of the static rise."""
    return design.extend(Term.STATIC_RISE, rise_column(samples, stribeck))


def stribeck_jacobian(design: Design, samples: Sequence[AxisSamples], solution: Solution, stribeck: Stribeck) -> Samples:
    """Derivatives of the torque by all parameters, Stribeck velocity and exponent last; (n, p + 2)."""
    rise = solution.value(Term.STATIC_RISE)
    velocity = np.concatenate([stribeck_velocity_column(entry.motion, rise, stribeck) for entry in samples])
    exponent = np.concatenate([stribeck_exponent_column(entry.motion, rise, stribeck) for entry in samples])
    return np.column_stack([design.matrix, velocity, exponent])


def stribeck_covariance(
    design: Design, samples: Sequence[AxisSamples], solution: Solution, stribeck: Stribeck, exponent: Exponent
) -> Covariance:
    """Covariance of (terms..., stribeck_velocity, exponent), (p + 2, p + 2), of the regression `design` with its rise.

    An exponent that the data tell is a parameter like the others. One that they cannot tell is taken as given, and to the
    covariance come the changes d of all parameters when the regression is solved at the ends of its interval, as if those
    lay a normal quantile z away: Cov + sum of d d' / z^2.
    """
    jacobian = stribeck_jacobian(design, samples, solution, stribeck)
    if exponent.told:
        return hac_covariance(design, jacobian, solution.residual)
    given = hac_covariance(design, jacobian[:, :-1], solution.residual)
    matrix = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    matrix[:-1, :-1] = given.matrix
    rest = design.pick([term for term in design.terms if term is not Term.STATIC_RISE])
    for end in exponent.interval:
        shape = at_exponent(rest, samples, stribeck, end)
        values = solve(with_stribeck(rest, samples, shape)).values
        change = np.array([*(values - solution.values), shape.velocity - stribeck.velocity, end - stribeck.exponent])
        matrix += np.outer(change, change) / exponent.quantile**2
    return Covariance(matrix, given.degrees_of_freedom)


def find_stribeck(design: Design, samples: Sequence[AxisSamples], settings: Settings) -> StribeckTest:
    """Look for a Stribeck term on top of `design`, which should carry all other terms, direction-dependent ones too.

    It is real where it is positive, significant, and takes away `settings.stribeck_gain` of the cross-validated residual
    energy. Its velocity and exponent mean nothing where there is no rise (Davies 1977), so that the best of many trials
    would be significant by chance: the p-value is that of the best one, its shape taken as given, times the number of
    trials (Bonferroni), and the gain has the shape chosen anew without each fold.
    """
    tried = survey(design, samples, settings.stribeck_exponent_bounds)
    best = tried.best() if tried else None
    if tried is None or best is None:
        return StribeckTest(False, 0.0, 0.0, 1.0, 0, None, None)
    blocks = Blocks(design)
    gain = searched_gain(blocks.matrix(design.matrix), tried.means, blocks.means(design.target))
    full = with_stribeck(design, samples, best)
    solution = solve(full)
    rise, index = solution.value(Term.STATIC_RISE), full.terms.index(Term.STATIC_RISE)
    given = hac_covariance(full, full.matrix, solution.residual)
    trials = len(tried.shapes)
    p_value = min(1.0, trials * given.p_value(rise, index))
    real = rise > 0 and p_value < settings.significance and gain >= settings.stribeck_gain
    shape, exponent = _shape(design, samples, best, settings) if real else (best, None)
    return StribeckTest(real, gain, rise / given.standard_error(index), p_value, trials, shape, exponent)


def _shape(design: Design, samples: Sequence[AxisSamples], start: Stribeck, settings: Settings) -> tuple[Stribeck, Exponent]:
    """The shape of least squares, its exponent as the settings have it where the data cannot tell."""
    free = best_shape(design, samples, start, settings.stribeck_exponent_bounds)
    full = with_stribeck(design, samples, free)
    exponent = _exponent(full, samples, solve(full), free, settings)
    return (free if exponent.told else at_exponent(design, samples, free, settings.stribeck_exponent)), exponent


def _exponent(
    design: Design, samples: Sequence[AxisSamples], solution: Solution, stribeck: Stribeck, settings: Settings
) -> Exponent:
    """Can the data tell the exponent? They cannot where its interval leaves the bounds."""
    low, high = settings.stribeck_exponent_bounds
    normal = float(special.ndtri(0.5 + settings.confidence / 2.0))
    jacobian = stribeck_jacobian(design, samples, solution, stribeck)
    weighted = jacobian * np.sqrt(design.weight)[:, None]
    if share_beside(weighted[:, :-1], weighted[:, -1]) < _DEGENERATE:
        return Exponent((low, high), False, normal)
    covariance = hac_covariance(design, jacobian, solution.residual)
    error = covariance.standard_error(len(covariance.matrix) - 1)
    factor = float(np.exp(min(covariance.quantile(settings.confidence) * error / stribeck.exponent, 10.0)))
    interval = stribeck.exponent / factor, stribeck.exponent * factor
    inside = low < interval[0] and interval[1] < high
    clipped = max(interval[0], low), min(interval[1], high)
    return Exponent(clipped, inside, normal)
