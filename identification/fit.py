"""One regression, solved: values, covariance, and the parameters with intervals that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.identification.covariance import Covariance, hac_covariance
from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.identification.least_squares import Solution, solve
from drivetwin.identification.regressors import Design, Stribeck, Term
from drivetwin.identification.result import Parameter
from drivetwin.identification.stribeck import Exponent, stribeck_covariance, with_stribeck
from drivetwin.motion.moving import AxisSamples


@dataclass(frozen=True)
class Fit:
    """A solved regression: `covariance` is of (terms..., and where there is one: stribeck_velocity, exponent)."""

    design: Design
    solution: Solution
    covariance: Covariance
    stribeck: Stribeck | None = None
    exponent: Exponent | None = None

    def law(self) -> FrictionLaw:
        """The friction part of it."""
        value = self.solution.value
        return FrictionLaw(
            coulomb=value(Term.COULOMB),
            viscous=value(Term.VISCOUS),
            offset=value(Term.OFFSET),
            viscous_difference=value(Term.VISCOUS_DIFFERENCE),
            static_rise=value(Term.STATIC_RISE),
            stribeck_velocity=self.stribeck.velocity if self.stribeck else None,
            stribeck_exponent=self.stribeck.exponent if self.stribeck else 2.0,
        )

    def combination(self, weights: dict[Term, float], unit: str, confidence: float) -> Parameter:
        """The parameter sum(weight * term), with its interval."""
        row = np.zeros((1, len(self.covariance.matrix)))
        for term, weight in weights.items():
            row[0, self.design.terms.index(term)] = weight
        value = sum(weight * self.solution.value(term) for term, weight in weights.items())
        half = self.covariance.quantile(confidence) * self.covariance.transformed(row).standard_error(0)
        return Parameter(float(value), unit, (float(value - half), float(value + half)))

    def stribeck_velocity(self, unit: str, confidence: float) -> Parameter:
        """With an interval that is symmetric in its logarithm: a speed is positive."""
        assert self.stribeck is not None
        return self._positive(self.stribeck.velocity, len(self.covariance.matrix) - 2, unit, confidence)

    def stribeck_exponent(self, bounds: tuple[float, float], confidence: float) -> Parameter:
        """The same, within the bounds in which it was sought."""
        assert self.stribeck is not None
        free = self._positive(self.stribeck.exponent, len(self.covariance.matrix) - 1, "1", confidence)
        return Parameter(free.value, "1", (max(free.interval[0], bounds[0]), min(free.interval[1], bounds[1])))

    def _positive(self, value: float, index: int, unit: str, confidence: float) -> Parameter:
        relative = self.covariance.quantile(confidence) * self.covariance.standard_error(index) / value
        factor = float(np.exp(min(relative, _WIDEST)))
        return Parameter(value, unit, (value / factor, value * factor))


_WIDEST = 20.0
"""Logarithm of the widest interval that is written, so that it stays a number."""


def plain_fit(design: Design) -> Fit:
    """Solve without a Stribeck term."""
    solution = solve(design)
    return Fit(design, solution, hac_covariance(design, design.matrix, solution.residual))


def stribeck_fit(design: Design, samples: Sequence[AxisSamples], stribeck: Stribeck, exponent: Exponent) -> Fit:
    """Solve with a Stribeck term of this shape, the shape's own uncertainty included."""
    full = with_stribeck(design, samples, stribeck)
    solution = solve(full)
    covariance = stribeck_covariance(full, samples, solution, stribeck, exponent)
    return Fit(full, solution, covariance, stribeck, exponent)
