"""Parameters that the model has and that are never exact: how far each may be off, and what torque that costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.prepare.deflection import axis_of, centred, is_torque
from drivetwin.diagnosis.prepare.positions import relative_axes
from drivetwin.diagnosis.prepare.rows import Column, Rows
from drivetwin.diagnosis.prepare.run import AxisRun, Run
from drivetwin.diagnosis.settings import LEAST_OFF, Settings
from drivetwin.emulator.dynamics import AxisDynamics
from drivetwin.emulator.effects import Effect, library
from drivetwin.motion.filtering import fine_derivative

Array = NDArray[np.float64]

ALIKE = 0.05
"""Share by which the torque of a body's mass must differ from that of an axis's inertia to be another parameter: the filter of
the comparison makes 2 to 4 % of it where an axis sticks now and then."""
STICKS = 0.01
"""Share of a row, filtered, up to which its axis may stick in it where two torques are compared."""
FEW = 0.25
"""Share of the rows, below which those that do not stick say too little, and all are compared."""
COSTS_NOTHING = 1e-9
"""Below which a torque is none [N·m or N]."""
MOST_LACKING = 0.95
"""Share of a rotor's inertia that it may lack: MuJoCo compiles no model with less than none."""


@dataclass(frozen=True)
class Nominal:
    """One parameter: what a unit of deviation costs (`column`), its nominal value, and how far it may be off.

    `effect` names the cause that it is if it is off: `coulomb`, `viscous`, `inertia` of an axis; `payload` for the mass and
    inertia together of a body, by number, in shares of its own; None for the timing of an axis [s]. `axis` is the one that it
    is of, of a body the one whose payload it would be, None if it is no axis's, and for the timing of a second encoder.
    `loaded_axis` is the same, but of a body the one of whose torque its mass costs the largest share.
    """

    effect: str | None
    axis: str | None
    loaded_axis: str
    body: int | None
    value: float
    spread: float
    column: Column
    told: bool = True
    """Whether the model says anything of it."""

    moment: bool = False
    """Whether it is the time between two readings of one row [s]."""

    place: tuple[float, ...] = ()
    """Of a body, its centre of mass where a payload of its axis would be (3,) [m]."""
    rotor: float = 0.0
    """Of an inertia, the part that the model has as `armature`, which an effect changes [kg·m² or kg]."""

    @property
    def timing(self) -> bool:
        """Whether it is of the recording and not of the model."""
        return self.effect is None and self.body is None

    def off_by(self, amount: float, within: float = 0.0) -> Effect | None:
        """What it is to be off by an amount, which is told `within` so much; None for the timing, for a body that is lighter or
        that no axis carries, and for an inertia of which the rotor has not as much."""
        if self.effect == "inertia" and amount < 0.0 and (self.rotor == 0.0 or amount + within < -self.rotor):
            return None
        if self.effect is None or self.axis is None or (self.body is not None and amount <= 0.0):
            return None
        kind = library()[self.effect]
        if self.body is not None:
            values = (amount * self.value, *self.place)
        else:
            less = -MOST_LACKING * self.rotor
            values = (max(less, amount) if self.effect == "inertia" else max(0.0, self.value + amount),)
        return kind(**{one.name: value for one, value in zip(kind.parameters, values, strict=True)})


def nominal_parameters(rows: Rows, settings: Settings) -> list[Nominal]:
    """Friction and inertia of every axis, every moving body, the timing of every axis, and that of every second encoder.

    A model without any friction on an axis does not say that there is none: it may be as large as the torque.
    """
    of_axes = _of_axes(rows, settings)
    of_recordings = [*_of_timing(rows, settings), *_of_encoders(rows, settings), *_of_loops(rows, settings), *_of_zeros(rows)]
    return [*of_axes, *_of_bodies(rows, of_axes, settings), *of_recordings]


def _of_axes(rows: Rows, settings: Settings) -> list[Nominal]:
    simulation = rows.simulation
    dynamics = simulation.dynamics()
    found = []
    for axis in simulation.axes:
        law = dynamics[axis].friction
        columns = (
            ("coulomb", law.coulomb, rows.rows(axis, lambda run, own: run.felt(own, np.sign(own.motion.velocity)))),
            ("viscous", law.viscous, rows.rows(axis, lambda run, own: run.felt(own, own.motion.velocity))),
            ("inertia", _inertia(rows, axis), rows.rows(axis, _acceleration)),
        )
        for effect, value, column in columns:
            whole = rows.size[axis] / max(_rms(column), 1e-12)
            told = effect == "inertia" or law.coulomb > 0.0 or law.viscous > 0.0
            spread = float(np.hypot(settings.nominal_spread * value, LEAST_OFF * whole)) if told else whole
            rotor = rows.motion[axis].rotor_inertia
            found.append(Nominal(effect, axis, axis, None, value, spread, {axis: column}, told, rotor=rotor))
    return found


def _acceleration(run: Run, own: AxisRun) -> Array:
    return run.felt(own, own.motion.acceleration)


def _inertia(rows: Rows, axis: str) -> float:
    """Of an axis with what follows it, in the middle of where it was."""
    return float(np.median(rows.motion[axis].inertia))


def _of_bodies(rows: Rows, of_axes: Sequence[Nominal], settings: Settings) -> list[Nominal]:
    """Bodies whose mass is felt otherwise than as inertia of the axes: by weight, or with the position."""
    found = []
    for body in rows.simulation.moving_bodies():
        column = rows.predicted_by_heavier(body)
        if any(_differs(rows, torque, axis, of_axes) for axis, torque in column.items()):
            loaded = max(column, key=lambda axis: _rms(column[axis]) / max(rows.size[axis], 1e-12))
            axis, place = rows.simulation.carrier(body) or (None, ())
            mass = float(rows.simulation.model.body_mass[body])
            found.append(Nominal("payload", axis, loaded, body, mass, settings.nominal_spread, column, place=place))
    return found


def _differs(rows: Rows, torque: Array, axis: str, of_axes: Sequence[Nominal]) -> bool:
    """Whether torque is anything else than a multiple of what the axis's own inertia costs."""
    own = next(one.column[axis] for one in of_axes if one.effect == "inertia" and one.axis == axis)
    return not is_multiple(rows, axis, torque, own)


def is_multiple(rows: Rows, axis: str, torque: Array, own: Array) -> bool:
    """Whether a torque (N,) on the rows of an axis is none, or hardly anything else than a multiple of another one.

    By the rows in which it does not stick, unless these are few: a model's torque is that of the filtered motion, and an axis's
    own is filtered itself.
    """
    moves = np.abs(rows.moves[axis] - 1.0) < STICKS
    if moves.sum() >= FEW * len(moves):
        torque, own = torque[moves], own[moves]
    size = _rms(torque)
    if size < COSTS_NOTHING or not own.any():
        return size <= COSTS_NOTHING
    return _rms(torque - own * (own @ torque) / (own @ own)) <= ALIKE * size


def _of_timing(rows: Rows, settings: Settings) -> list[Nominal]:
    """The moment at which each axis's position was counted, against its torque: known to a fraction of a sample."""
    dynamics = rows.simulation.dynamics()
    late = timing_error(rows.runs, settings)
    columns = {axis: rows.rows(axis, partial(_slope, dynamics[axis])) for axis in rows.axes}
    return [Nominal(None, axis, axis, None, 1.0, late, {axis: column}, moment=True) for axis, column in columns.items()]


def _of_encoders(rows: Rows, settings: Settings) -> list[Nominal]:
    """The moment at which a joint's encoder was counted, against that of its motor."""
    found = []
    for name in rows.compared:
        if not is_torque(name):
            axis = axis_of(name)
            speed = centred(rows.rows(axis, lambda run, own: run.smooth(own.motion.velocity)), rows.of[axis].run)
            found.append(Nominal(None, None, axis, None, 1.0, timing_error(rows.runs, settings), {name: speed}, moment=True))
    return found


def _of_loops(rows: Rows, settings: Settings) -> list[Nominal]:
    """Of a torque that loops asked for and nobody recorded: what the integral held as each recording began, and its scale."""
    found = []
    of_each = {run.recording.name: run for run in rows.runs}
    for axis in rows.axes:
        for number, (name, one) in enumerate(of_each.items()):
            asked = one.axes[axis].asked
            if asked is not None and asked.floats:
                column = rows.rows(axis, partial(_held_in, name))
                found.append(Nominal(None, None, axis, None, 1.0, _rms(rows.measured[axis]), {axis: column}))
            if asked is not None and not asked.scale_told and number == 0:
                scale = {axis: rows.rows(axis, lambda _, own: own.base)}
                found.append(Nominal(None, None, axis, None, 1.0, settings.nominal_spread, scale))
    return found


def _of_zeros(rows: Rows) -> list[Nominal]:
    """Of each recording whose position has a zero of its own: how far it is from where the model's torque has it.

    As much as would cost the whole torque: the model that found it lacks what is looked for.
    """
    found = []
    for name, axes in {run.recording.name: relative_axes(run.recording) for run in rows.runs}.items():
        for axis in axes:
            column = {on: torque for on, torque in rows.shifted(name, axis).items() if torque.any()}
            if column:
                spread = min(_rms(rows.measured[on]) / _rms(torque) for on, torque in column.items())
                found.append(Nominal(None, None, axis, None, 1.0, spread, column))
    return found


def _held_in(recording: str, run: Run, own: AxisRun) -> Array:
    """What a torque 1 that acts in one recording, by its name, is compared as."""
    return run.moves(own) * float(run.recording.name == recording)


def timing_error(runs: Sequence[Run], settings: Settings) -> float:
    """Standard deviation of the time between two readings of one row [s]."""
    period = float(np.median([run.period for run in runs]))
    return float(np.hypot(settings.timing_spread, settings.timing_share * period))


def _slope(dynamics: AxisDynamics, run: Run, own: AxisRun) -> Array:
    friction = dynamics.friction.resistance(own.motion)
    simulated = own.motion.rigid_torque - own.motion.from_others + friction
    return fine_derivative(run.felt(own, simulated), run.period, run.cutoff_hz)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
