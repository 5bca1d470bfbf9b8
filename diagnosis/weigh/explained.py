"""What effects leave of the torque of an axis, as the axis's part of the model: in a colour, with an unknown or without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.axis_system import AxisSystem, axis_system
from drivetwin.diagnosis.model.colour import Colour, colour_of
from drivetwin.diagnosis.prepare.deflection import axis_of
from drivetwin.diagnosis.propose.side_by_side import by_key
from drivetwin.diagnosis.weigh.bench import NO_TORQUE, Bench

Array = NDArray[np.float64]


def explained(
    bench: Bench, axis: str, known: Colour | AxisSystem, needed: Array, costs: Sequence[Array]
) -> tuple[Array, AxisSystem]:
    """What effects leave of a torque, and the system of the axis with it."""
    target = needed.copy()
    for rows in costs:
        target -= rows
    return target, _axis_system(bench, axis, known, target)


def colour_in(known: Colour | AxisSystem) -> Colour:
    """The colour itself, or that of an axis's system."""
    return known.colour if isinstance(known, AxisSystem) else known


def _axis_system(bench: Bench, axis: str, known: Colour | AxisSystem, target: Array) -> AxisSystem:
    if isinstance(known, AxisSystem):
        return replace(known, target=known.colour.whiten(target))
    parts = [component.columns for component in bench.unknown[axis_of(axis)]]
    component = np.repeat(np.arange(len(parts)), [part.shape[1] for part in parts])
    misfit = max(bench.settings.misfit * bench.rows.size[axis], NO_TORQUE)
    return axis_system(known, np.column_stack(parts), component, misfit, target, bench.rows.of[axis].block)


def plain_axis(bench: Bench, axis: str, target: Array) -> AxisSystem:
    """An axis without colour and unknown."""
    rows = bench.rows.of[axis]
    return axis_system(bench.white[axis], np.zeros((len(rows), 0)), np.zeros(0, dtype=np.intp), 1.0, target, rows.block)


def colours_of(bench: Bench, residual: Mapping[str, Array]) -> dict[str, Colour]:
    """The colour of what everything that could be asked leaves (N,) of each axis [N·m or N]."""

    def colour(axis: str) -> Colour:
        rows, order = bench.rows.of[axis], bench.settings.colour_order
        return colour_of(rows, bench.clocks, residual[axis], order, bench.noise_floor(axis))

    return by_key(colour, residual)
