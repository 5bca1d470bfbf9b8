"""The mean of the smooth unknown as a table for the patch, so that the gap shrinks where it has no name.

What the patch leaves on the fitted motion is regressed on curves over the position, with and without the direction, and over
the speed in each direction: the parts of the unknown that a plant can have again (`model/unknown.py`; what goes with load or
time is left as it is). Their prior is the unknown's Gaussian process; how much of it is chosen by the fitted motion, each of
five folds of contiguous time held out in turn. On motion that was not fitted a table that makes the gap larger is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.unknown import shapes
from drivetwin.diagnosis.prepare.prepared import Prepared
from drivetwin.diagnosis.propose.placing import placed
from drivetwin.diagnosis.report.gaps import Gaps
from drivetwin.diagnosis.report.prediction import Patch, gap_rms, predict
from drivetwin.diagnosis.report.result import AxisPrediction, Prediction, Residual
from drivetwin.diagnosis.settings import Settings
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.residual_table import PLACES, SPEEDS, ResidualTable, place_of, speed_of, way_of

Array = NDArray[np.float64]

FREEDOM = (1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)
"""Of the mean energy of a column: what holds the curves to 0, tried in turn; each ten times as much as the one before."""
PER_PERIOD = 6.0
"""Samples a period of the cut-off that are fitted: between them nothing is told."""


@dataclass(frozen=True)
class _Axes:
    """The scales of an axis's table: the span of its position [rad or m] and its top speed."""

    span: tuple[float, float]
    top: float


def with_residual(
    ready: Prepared, gaps: Gaps, unknown: Mapping[str, float], settings: Settings
) -> tuple[tuple[Residual, ...], tuple[Prediction, ...]]:
    """Tables of the axes that have a share of `unknown` and on which they help, and what is predicted with them.

    `unknown`: its share of the gap on motion that was not fitted.
    """
    tables = {axis: found for axis in unknown if (found := _table(ready, gaps, axis, settings)) is not None}
    told = _predicted(ready, gaps, list(tables.values()))
    kept = [axis for axis in tables if gap_rms(told, axis, "after") < gap_rms(gaps.unseen, axis, "after")]
    if len(kept) < len(tables):
        told = _predicted(ready, gaps, [tables[axis] for axis in kept])
    return tuple(_residual(gaps, told, tables[axis], unknown[axis]) for axis in kept), tuple(told if kept else ())


def _predicted(ready: Prepared, gaps: Gaps, tables: Sequence[PlacedEffect]) -> list[Prediction]:
    """Without what a table changes of the axes that have none: it has no other."""
    patch = Patch((*gaps.patch.effects, *tables), gaps.patch.heavier)
    return [predict(ready.simulation, run, patch) for run in ready.checks]


def _residual(gaps: Gaps, told: Sequence[Prediction], table: PlacedEffect, unknown: float) -> Residual:
    axis = table.axis
    before, left, now = gap_rms(gaps.unseen, axis), gap_rms(gaps.unseen, axis, "after"), gap_rms(told, axis, "after")
    closed = (left**2 - now**2) / max(before**2, 1e-300)
    return Residual(table, float(min(closed / unknown, 1.0)), float(now))


def _table(ready: Prepared, gaps: Gaps, axis: str, settings: Settings) -> PlacedEffect | None:
    """The table of what is left on the fitted motion; None where it tells nothing."""
    parts = [(each.axes[axis], max(1, int(1.0 / (PER_PERIOD * ready.cutoff_hz * each.period)))) for each in gaps.fitted]
    moving = [part for part, _ in parts if part.used.any()]
    if not moving:
        return None
    position = np.concatenate([part.position[part.used] for part in moving])
    speed = np.abs(np.concatenate([part.velocity[part.used] for part in moving]))
    scales = _Axes((float(position.min()), float(position.max())), max(float(np.quantile(speed, 0.999)), 1e-9))
    regressors, left = (np.concatenate(each) for each in zip(*(_rows(*one, scales) for one in parts), strict=True))
    known = ready.absolute[axis] and not any(axis in run.unplaced for run in ready.runs)
    basis = _basis(known, settings.misfit_waves)
    chosen = _mean(regressors @ basis, left, settings)
    if chosen is None:
        return None
    knots = basis @ chosen
    position_table, reversing, forward, backward = np.split(knots, [PLACES, 2 * PLACES, 2 * PLACES + SPEEDS])
    effect = ResidualTable.of_knots(scales.span, scales.top, position_table, reversing, forward, backward)
    return placed(ready.rows, axis, effect)


def _rows(part: AxisPrediction, every: int, scales: _Axes) -> tuple[Array, Array]:
    """Weights (n, knots) of a table's knots on samples in motion, and what is left there (n,)."""
    used = np.flatnonzero(part.used)[::every]
    velocity = part.velocity[used]
    places = _hats(place_of(part.position[used], *scales.span), PLACES)
    speeds = _hats(speed_of(velocity, scales.top), SPEEDS + 1)[:, 1:]
    forward, way = velocity[:, None] > 0.0, way_of(velocity, scales.top)[:, None]
    columns = np.hstack([places, way * places, np.where(forward, speeds, 0.0), np.where(forward, 0.0, -speeds)])
    return columns, (part.measured - part.after)[used]


def _hats(at: Array, knots: int) -> Array:
    """Weights (n, knots) of even knots from 0 to 1, joined by straight lines."""
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(at[:, None] * (knots - 1) - np.arange(knots))))


def _basis(absolute: bool, waves: float) -> Array:
    """Curves (knots, m) whose coefficients are alike before anything is known; over position only where it means the same."""
    places, speeds = shapes(waves, PLACES), shapes(waves, SPEEDS + 1)[1:]
    blocks = [places if absolute else places[:, :0], places if absolute else places[:, :0], speeds, speeds]
    rows, columns = sum(len(each) for each in blocks), sum(each.shape[1] for each in blocks)
    found, row, column = np.zeros((rows, columns)), 0, 0
    for each in blocks:
        found[row : row + len(each), column : column + each.shape[1]] = each
        row, column = row + len(each), column + each.shape[1]
    return found


def _mean(columns: Array, left: Array, settings: Settings) -> Array | None:
    """Coefficients (m,) held to 0 as much as predicts what is held out best; None where nothing is best."""
    block = np.arange(len(left)) * settings.blocks // max(len(left), 1)
    folds = [np.flatnonzero(block % settings.folds == fold) for fold in range(settings.folds)]
    grams = np.array([columns[rows].T @ columns[rows] for rows in folds])
    loads = np.array([columns[rows].T @ left[rows] for rows in folds])
    gram, load = grams.sum(axis=0), loads.sum(axis=0)
    size = max(float(np.trace(gram)) / len(gram), 1e-300)

    def explained(freedom: float) -> float:
        """Energy of what is held out."""
        energy = 0.0
        for own, held in zip(grams, loads, strict=True):
            found = _held_to_0(gram - own, load - held, freedom * size)
            energy += float(2.0 * found @ held - found @ own @ found)
        return energy

    best = max(FREEDOM, key=explained)
    return _held_to_0(gram, load, best * size) if explained(best) > 0.0 else None


def _held_to_0(gram: Array, load: Array, by: float) -> Array:
    return np.asarray(np.linalg.solve(gram + by * np.eye(len(gram)), load))
