"""Parameters that the model has and that are never exact: how far each may be off, and what torque that costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from diagnosis.comparison import Column, Comparison
from diagnosis.measured import AxisRun, Run
from drivetwin.motion.filtering import derivative
from emulator.dynamics import AxisDynamics

Array = NDArray[np.float64]

SPREAD = 0.04
"""Standard deviation of a nominal parameter about the true one, as a share: 'a few per cent'."""
TIMING = 3e-4
"""Standard deviation of the time by which torque and position of a sample differ [s]."""
ALIKE = 0.02
"""Share by which the torque of a body's mass must differ from that of the axes' inertia to be a parameter of its own."""
FLOOR = 0.005
"""The same for a parameter that the model has not, as a share of the axis's torque."""


@dataclass(frozen=True)
class Nominal:
    """One parameter: what a unit of deviation costs (`column`), its nominal value, and how far it may be off.

    `effect` names the cause that it is if it is off: `coulomb`, `viscous`, `inertia` of an axis; None for the mass and inertia
    together of a body, by number, in shares of its own, and for the timing of an axis [s]. `loaded_axis` is the axis that it is
    of; of a body, the one of whose torque its mass costs the largest share.
    """

    effect: str | None
    axis: str | None
    loaded_axis: str
    body: int | None
    value: float
    spread: float
    column: Column

    @property
    def key(self) -> tuple[str | None, str | None, int | None]:
        """What it is a parameter of."""
        return self.effect, self.axis, self.body

    @property
    def timing(self) -> bool:
        """Whether it is of the recording and not of the model."""
        return self.effect is None and self.body is None


def nominal_parameters(comparison: Comparison) -> Sequence[Nominal]:
    """Friction and inertia of every axis, and every moving body."""
    if not comparison.nominals:
        of_axes = _of_axes(comparison)
        comparison.nominals.extend([*of_axes, *_of_bodies(comparison, of_axes), *_of_timing(comparison)])
    return list(comparison.nominals)


def like(nominals: Sequence[Nominal], comparison: Comparison) -> list[Nominal]:
    """The same parameters with the same priors, as another comparison feels them."""
    known = {one.key: one for one in nominal_parameters(comparison)}
    return [replace(one, column=known[one.key].column) for one in nominals if one.key in known]


def _of_axes(comparison: Comparison) -> list[Nominal]:
    simulation = comparison.simulation
    dynamics = simulation.dynamics()
    found = []
    for axis in simulation.axes:
        law = dynamics[axis].friction
        torque = _rms(comparison.measured[axis])
        columns = (
            ("coulomb", law.coulomb, comparison.rows(axis, lambda run, own: run.felt(own, np.sign(own.motion.velocity)))),
            ("viscous", law.viscous, comparison.rows(axis, lambda run, own: run.felt(own, own.motion.velocity))),
            ("inertia", _inertia(comparison, axis), comparison.rows(axis, _acceleration)),
        )
        for effect, value, column in columns:
            floor = FLOOR * torque / max(_rms(column), 1e-12)
            spread = float(np.hypot(SPREAD * value, floor))
            found.append(Nominal(effect, axis, axis, None, value, spread, {axis: column}))
    return found


def _acceleration(run: Run, own: AxisRun) -> Array:
    return run.felt(own, own.motion.acceleration)


def _inertia(comparison: Comparison, axis: str) -> float:
    """Of an axis with what follows it, in the middle of where it was."""
    return float(np.median(np.concatenate([run.axes[axis].motion.inertia for run in comparison.runs])))


def _of_bodies(comparison: Comparison, of_axes: Sequence[Nominal]) -> list[Nominal]:
    """Bodies whose mass is felt otherwise than as inertia of the axes: by weight, or with the position."""
    simulation = comparison.simulation
    found = []
    for body in simulation.moving_bodies():
        column = comparison.predicted_by_heavier(body)
        if any(_apart(rows, axis, of_axes) for axis, rows in column.items()):
            found.append(Nominal(None, None, _most_loaded(comparison, column), body, 1.0, SPREAD, column))
    return found


def _most_loaded(comparison: Comparison, column: Column) -> str:
    return max(column, key=lambda axis: _rms(column[axis]) / max(_rms(comparison.measured[axis]), 1e-12))


def _apart(rows: Array, axis: str, of_axes: Sequence[Nominal]) -> bool:
    """Whether torque is anything else than a multiple of what the axis's own inertia costs."""
    size = _rms(rows)
    own = next(one.column[axis] for one in of_axes if one.effect == "inertia" and one.axis == axis)
    if size < 1e-9 or not own.any():
        return size > 1e-9
    return _rms(rows - own * (own @ rows) / (own @ own)) > ALIKE * size


def _of_timing(comparison: Comparison) -> list[Nominal]:
    """The moment at which each axis's position was counted, against its torque: known to a fraction of a sample."""
    found = []
    dynamics = comparison.simulation.dynamics()
    for axis in comparison.simulation.axes:
        rows = comparison.rows(axis, partial(_slope, dynamics[axis]))
        found.append(Nominal(None, axis, axis, None, 1.0, TIMING, {axis: rows}))
    return found


def _slope(dynamics: AxisDynamics, run: Run, own: AxisRun) -> Array:
    friction = own.motion.kept(dynamics.friction, dynamics.friction.resistance)
    simulated = own.motion.rigid_torque - own.motion.from_others + friction
    return run.felt(own, derivative(simulated, run.period))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
