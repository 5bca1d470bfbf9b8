"""Does the friction rise towards low speed, and how: the Stribeck term.

The regression is linear but for the Stribeck velocity, which variable projection takes out (Golub and Pereyra 1973):
for each trial velocity the linear parameters are solved for, and the velocity with the least squares wins.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from controller.identification.covariance import hac_covariance
from controller.identification.least_squares import Solution, solve
from controller.identification.motion import AxisSamples
from controller.identification.regressors import Design, Indices, Stribeck, Term, column, stribeck_velocity_column
from controller.identification.settings import Settings
from drivetwin.recording.recording import Samples

_TRIALS = 40
_BLOCK = 0.5
_FOLDS = 5
_TOP_SHARE = 0.5
_LEAST_SLOW_SHARE = 0.01


@dataclass(frozen=True)
class StribeckTest:
    """`gain`: share of the cross-validated residual energy of 0.5 s means that the term takes away; `statistic`: of the
    static rise over its standard error."""

    real: bool
    gain: float
    statistic: float
    p_value: float
    stribeck: Stribeck | None


@dataclass(frozen=True)
class _Trials:
    """The Stribeck column's best velocity and how its residual energy was found."""

    velocity: float
    gain: float


def with_stribeck(design: Design, samples: Sequence[AxisSamples], stribeck: Stribeck) -> Design:
    """`design` with the column of the static rise."""
    return design.extend(Term.STATIC_RISE, _stacked(samples, stribeck))


def stribeck_jacobian(design: Design, samples: Sequence[AxisSamples], solution: Solution, stribeck: Stribeck) -> Samples:
    """Derivatives of the torque by all parameters, that of the Stribeck velocity last; (n, p + 1)."""
    rise = solution.value(Term.STATIC_RISE)
    last = np.concatenate([stribeck_velocity_column(entry.motion, rise, stribeck) for entry in samples])
    return np.column_stack([design.matrix, last])


def find_stribeck(design: Design, samples: Sequence[AxisSamples], settings: Settings) -> StribeckTest:
    """Look for a Stribeck term on top of `design`, which should carry all other terms, direction-dependent ones too.

    It is real where it is positive, significant, and takes away `settings.stribeck_gain` of the cross-validated
    residual energy. The energy is that of 0.5 s means, folds of alternating blocks: a friction law is about the mean
    torque at a speed, not about ripple.
    """
    trials = _try_velocities(design, samples, settings.stribeck_exponent)
    if trials is None:
        return StribeckTest(False, 0.0, 0.0, 1.0, None)
    stribeck = Stribeck(trials.velocity, settings.stribeck_exponent)
    full = with_stribeck(design, samples, stribeck)
    solution = solve(full)
    rise = solution.value(Term.STATIC_RISE)
    jacobian = stribeck_jacobian(full, samples, solution, stribeck)
    covariance = hac_covariance(full, jacobian, solution.residual)
    index = full.terms.index(Term.STATIC_RISE)
    p_value = covariance.p_value(rise, index)
    real = rise > 0 and p_value < settings.significance and trials.gain >= settings.stribeck_gain
    return StribeckTest(real, trials.gain, rise / covariance.standard_error(index), p_value, stribeck)


def cross_validated_gain(design: Design, fewer: Sequence[Term]) -> float:
    """Share of the cross-validated residual energy of 0.5 s means that `design` takes away beside its terms `fewer`."""
    means, fold = _block_means(design)
    count = len(design.terms)
    few = [design.terms.index(term) for term in fewer]
    before = _cross_validated(means, fold, few)
    after = _cross_validated(means, fold, list(range(count)))
    return 1.0 - after / before if before > 0 else 0.0


def _try_velocities(design: Design, samples: Sequence[AxisSamples], exponent: float) -> _Trials | None:
    """The Stribeck velocity of least squares among those with a positive rise; None where no trial has one."""
    grid = _trial_velocities(samples)
    if len(grid) == 0:
        return None
    energy = _energy(design, samples, exponent)
    tried = np.array([energy(float(np.log(velocity))) for velocity in grid])
    best = int(np.argmin(tried))
    if tried[best] >= tried.max():
        return None
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(energy, bounds=(np.log(low), np.log(high)), method="bounded", options={"xatol": 1e-4})
    velocity = float(np.exp(found.x)) if found.fun < tried[best] else float(grid[best])
    full = with_stribeck(design, samples, Stribeck(velocity, exponent))
    return _Trials(velocity, cross_validated_gain(full, design.terms))


def _energy(design: Design, samples: Sequence[AxisSamples], exponent: float) -> Callable[[float], float]:
    """Residual energy as a function of log stribeck_velocity, that without the term where its rise is not positive."""
    rows = design.weight > 0
    root = np.sqrt(design.weight[rows])
    basis, _ = np.linalg.qr(design.matrix[rows] * root[:, None])
    rest = design.target[rows] * root
    rest = rest - basis @ (basis.T @ rest)
    worst = float(rest @ rest)

    def energy(log_velocity: float) -> float:
        values = _stacked(samples, Stribeck(float(np.exp(log_velocity)), exponent))[rows] * root
        values = values - basis @ (basis.T @ values)
        norm, product = float(values @ values), float(values @ rest)
        if product <= 0 or norm <= 0:
            return worst
        return worst - product**2 / norm

    return energy


def _trial_velocities(samples: Sequence[AxisSamples]) -> Samples:
    """Geometric from the speed below which 1 % of the motion lies to half the top speed [rad/s or m/s]."""
    speed = np.concatenate([np.abs(entry.motion.velocity[entry.fitted]) for entry in samples])
    weight = np.concatenate([np.full(int(entry.fitted.sum()), entry.motion.period) for entry in samples])
    order = np.argsort(speed)
    share = np.cumsum(weight[order]) / weight.sum()
    low = float(speed[order][np.searchsorted(share, _LEAST_SLOW_SHARE)])
    high = _TOP_SHARE * float(speed.max())
    return np.geomspace(low, high, _TRIALS) if 0 < low < high else np.empty(0)


def _stacked(samples: Sequence[AxisSamples], stribeck: Stribeck) -> Samples:
    return np.concatenate([column(entry.motion, Term.STATIC_RISE, stribeck) for entry in samples])


def _block_means(design: Design) -> tuple[Samples, Indices]:
    """Weighted means over 0.5 s of columns and target, times the root of their weight, (blocks, p + 1); their folds."""
    seconds = np.floor(design.seconds / _BLOCK).astype(np.int64)
    _, block = np.unique(np.column_stack([design.piece, seconds]), axis=0, return_inverse=True)
    block = block.ravel()
    weight = np.bincount(block, weights=design.weight)
    used = weight > 0
    both = np.column_stack([design.matrix, design.target])
    sums = np.column_stack([np.bincount(block, weights=values * design.weight) for values in both.T])
    means = sums[used] / np.sqrt(weight[used])[:, None]
    return means, np.arange(len(means), dtype=np.int64) % _FOLDS


def _cross_validated(means: Samples, fold: Indices, columns: list[int]) -> float:
    """Residual energy of each fold under the fit to the others."""
    energy = 0.0
    for held in range(_FOLDS):
        out = fold == held
        values, *_ = np.linalg.lstsq(means[~out][:, columns], means[~out, -1], rcond=None)
        rest = means[out, -1] - means[out][:, columns] @ values
        energy += float(rest @ rest)
    return energy
