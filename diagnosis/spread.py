"""Intervals of an effect's parameters: from the curvature of the fit, residuals weighed by how long they remember."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.placing import in_order
from diagnosis.regression import covariance
from diagnosis.result import TWO_SIDED_90, Estimate
from diagnosis.search import movable_fields
from diagnosis.state import State, state_with
from drivetwin.errors import UserError
from emulator.effects import DriveEffect, PlacedEffect

DRIVE_DEVIATION = 0.02
"""Of a drive's parameter, in its own size: a convention, for no curvature tells it."""


def intervals(final: State, tried_in: State, one: PlacedEffect, selected: bool) -> Mapping[str, Estimate]:
    """Every parameter with its 90 % interval; `selected`: the final state has the effect in it."""
    if isinstance(one.effect, DriveEffect):
        return {
            parameter.name: _estimate(one, parameter.name, DRIVE_DEVIATION * abs(getattr(one.effect, parameter.name)))
            for parameter in type(one.effect).parameters
        }
    if selected:
        state, effects = final, final.selected
    else:
        effects = in_order([*tried_in.selected, one])
        try:
            state = state_with(tried_in.comparison, tried_in.nominals, effects, tried_in.noise)
        except UserError:
            names = [parameter.name for parameter in type(one.effect).parameters]
            return {name: _estimate(one, name, abs(float(getattr(one.effect, name)))) for name in names}
    at = len(state.nominals)
    spread = np.sqrt(np.maximum(np.diag(covariance(state.regression, without_prior_from=at)), 0.0))
    for other in effects:
        if isinstance(other.effect, DriveEffect):
            continue
        fields = movable_fields(other.effect)
        if (other.effect.name, other.axis) == (one.effect.name, one.axis):
            return {
                field.name: _estimate(one, field.name, float(spread[at + k]) * field.size) for k, field in enumerate(fields)
            }
        at += len(fields)
    return {}


def _estimate(one: PlacedEffect, name: str, deviation: float) -> Estimate:
    value = float(getattr(one.effect, name))
    half = TWO_SIDED_90 * deviation
    return Estimate(value, one.units.get(name, ""), (value - half, value + half))
