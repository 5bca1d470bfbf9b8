"""What has been selected so far, as the regression in which everything further is tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from diagnosis.comparison import Column, Comparison
from diagnosis.corrections import corrections
from diagnosis.model_search import polynomial
from diagnosis.nominal import Nominal
from diagnosis.regression import FIRST_MEMORY, Fitted, Regression
from diagnosis.search import INNER, Predict, tangents
from drivetwin.errors import UserError
from emulator.dynamics import AxisDynamics
from emulator.effects import AxisEffect, DriveEffect, Effect, ModelEffect, PlacedEffect

Array = NDArray[np.float64]

SELECTED_SPREAD = 0.5
"""Standard deviation of a selected effect's parameter about its value, in its own size: it may move beside another."""
LONGEST_MEMORY = 2.0
"""Residuals further apart than this are taken as independent [s]."""
LEAST_MEMORY = 10.0
"""Rows that count as one, at least: a block is never as telling as its rows would be one by one."""


@dataclass(frozen=True)
class State:
    """What has been selected so far, and the regression that everything further is tried in."""

    comparison: Comparison
    nominals: Sequence[Nominal]
    selected: tuple[PlacedEffect, ...]
    dynamics: Mapping[str, AxisDynamics]
    regression: Regression
    noise: Mapping[str, float]
    corrected: tuple[PlacedEffect, ...] = ()
    """Friction and inertia as fitted beside springs and gaps, whose own motion goes by them."""

    @cached_property
    def residual(self) -> dict[str, Array]:
        """What is left on the rows of each axis, nominal parameters and selected effects fitted."""
        return self.regression.residual(self.regression.fit())


def state_with(
    comparison: Comparison, nominals: Sequence[Nominal], selected: tuple[PlacedEffect, ...], noise: Mapping[str, float]
) -> State:
    """The selected effects at the parameters that they have, free to move a little beside whatever is tried next.

    `noise` is each axis's noise [N·m or N]: improvements below it count less and less.
    """
    state = _state(comparison, nominals, selected, noise, ())
    if not any(placed.effect.family == INNER for placed in selected):
        return state
    try:
        return _state(comparison, nominals, selected, noise, corrected_by_fit(state, state.regression.fit()))
    except UserError:
        return state


def _state(
    comparison: Comparison,
    nominals: Sequence[Nominal],
    selected: tuple[PlacedEffect, ...],
    noise: Mapping[str, float],
    corrected: tuple[PlacedEffect, ...],
) -> State:
    dynamics = comparison.simulation.dynamics((*corrected, *selected))
    target = {axis: rows.copy() for axis, rows in comparison.target.items()}
    columns = [nominal.column for nominal in nominals]
    spreads = [nominal.spread for nominal in nominals]
    for number, placed in enumerate(selected):
        if isinstance(placed.effect, DriveEffect):
            continue
        before = comparison.simulation.dynamics((*corrected, *selected[:number]))
        predict = predictor(comparison, placed.axis, placed.effect, before)
        for axis, rows in predict(placed.effect).items():
            target[axis] = target[axis] - rows
        free = tangents(placed.effect, predict)
        columns.extend(free)
        spreads.extend([SELECTED_SPREAD] * len(free))
    scale = {axis: max(_rms(rows), 1e-12) * np.sqrt(FIRST_MEMORY) for axis, rows in target.items()}
    stands_for = {("delay", one.axis): frozenset({k}) for k, one in enumerate(nominals) if one.timing and one.axis}
    regression = Regression(comparison, columns, spreads, target, scale, noise, stands_for)
    for _ in range(2):
        residual = regression.residual(regression.fit())
        regression = regression.rescaled(scales(comparison, residual, noise))
    return State(comparison, nominals, selected, dynamics, regression, noise, corrected)


def corrected_by_fit(state: State, fitted: Fitted) -> tuple[PlacedEffect, ...]:
    """Friction and inertia as a fit has them, but for what an effect is selected for."""
    chosen = {(placed.effect.name, placed.axis) for placed in state.selected}
    found = corrections(state.comparison, state.nominals, fitted.coefficients[: len(state.nominals)].tolist())
    return tuple(one for one in found if (one.effect.name, one.axis) not in chosen)


def predictor(comparison: Comparison, axis: str, effect: Effect, dynamics: Mapping[str, AxisDynamics]) -> Predict:
    """A function from an effect of this kind to the torque that it costs on the compared rows."""
    if isinstance(effect, AxisEffect):

        def cost(changed: Effect) -> Column:
            assert isinstance(changed, AxisEffect)
            return comparison.cost(axis, changed, dynamics[axis])

        return cost
    known = polynomial(comparison, axis, type(effect)) if isinstance(effect, ModelEffect) else None
    if known is None:
        raise UserError(f"axis {axis} cannot have {effect.name}")
    return known.column


def scales(comparison: Comparison, residual: Mapping[str, Array], noise: Mapping[str, float]) -> dict[str, float]:
    """Residual rms of each axis, and what is too little to tell, times the square root of the rows that count as one."""
    return {
        axis: max(float(np.hypot(_rms(rows), noise[axis])), 1e-12) * np.sqrt(memory(comparison, axis, rows))
        for axis, rows in residual.items()
    }


def memory(comparison: Comparison, axis: str, residual: Array) -> float:
    """Rows that count as one: 1 + 2 sum of the residual's autocorrelation, up to where it first is not positive.

    Recording by recording, by their energy.
    """
    counted, weight = 0.0, 0.0
    for part, run in zip(comparison.in_time(axis, residual), comparison.runs, strict=True):
        lags = int(LONGEST_MEMORY / (run.period * run.stride))
        energy = float(part @ part)
        if len(part) <= lags or energy <= 0.0:
            continue
        size = next_fast_len(len(part) + lags, real=True)
        spectrum = rfft(part, size)
        correlation = irfft(spectrum * spectrum.conj(), size)[1 : lags + 1] / energy
        ends = np.flatnonzero(correlation <= 0.0)
        positive = correlation[: ends[0]] if ends.size else correlation
        counted += energy * (1.0 + 2.0 * float(positive.sum()))
        weight += energy
    return max(LEAST_MEMORY, counted / weight) if weight > 0.0 else LEAST_MEMORY


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
