"""Moves a model as a machine moved: from the recorded start, by the recorded demand, through the drive's loops."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import POSITION, SERVO_PERIOD, TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop, ServoBank
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.mechanism import Mechanism
from drivetwin.emulator.plant import equip
from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.twin.loops import Loops, loops_of
from drivetwin.twin.plant import mechanism_of

Array = NDArray[np.float64]

START = 0.02
"""Of a recording [s]: its position there tells the velocity with which an axis begins."""
FEWEST = 5
"""Rows that tell it at least."""


@dataclass(frozen=True)
class AxisReplay:
    """Position (n,) [rad or m] and torque (n,) [N·m or N] that the simulated drive tells at the recording's times."""

    position: Array
    torque: Array
    loops: Loops


@dataclass(frozen=True)
class _Grid:
    """Time steps: `step` [s] of the plant; `servo` of them are a servo period, `row` of them a sample of the recording."""

    step: float
    servo: int
    row: int

    @property
    def period(self) -> float:
        """Of the servo [s]."""
        return self.step * self.servo

    def rows(self, count: int) -> Array:
        """At which row, and between which, each servo period of `count` rows begins."""
        return np.arange(0, (count - 1) * self.row + 1, self.servo) / self.row


@dataclass(frozen=True)
class _Course:
    """Demand (m, 4) of an axis at every servo period as the servo takes it, and how the axis begins; joint side."""

    loops: Loops
    demand: Array
    position: float
    velocity: float
    torque: float | None


def replay(path: Path, recording: Recording, effects: tuple[PlacedEffect, ...]) -> dict[str, AxisReplay]:
    """Run the model of an MJCF file with these effects through a recording; by axis.

    Row k of the recording is the servo period that begins at its time: its position, demand and torque. Between rows the demand
    is a straight line, offsets stay. The axes begin at the recorded position and velocity, and at the recorded torque where an
    integral can hold it. Raises UserError where recording and model do not say enough, and where the simulation is unstable.
    """
    where = str(recording.files[0] if recording.files else recording.name)
    model = read_mjcf(path)
    axes = recording.info.axes
    grid = _grid(recording)
    courses = {
        axis: _course(f"{where}: axis {axis}", recording, axis, loops_of(f"{where}: axis {axis}", info, model), grid)
        for axis, info in axes.items()
    }
    start = {axis: course.position for axis, course in courses.items()}
    mechanism = mechanism_of(path, axes, start, effects, grid.step)
    mechanism.set_velocities(np.array([course.velocity for course in courses.values()]))
    gears = np.array([axis.gear_ratio for axis in mechanism.dynamics.values()])
    servos = _servos(list(courses.values()), mechanism, gears, grid)
    demands = np.stack([_of_motor(course.demand, gear) for course, gear in zip(courses.values(), gears, strict=True)], axis=1)
    position, torque = _run(mechanism, servos, demands, grid, len(recording.time))
    if not np.isfinite(position).all() or mechanism.data.warning.number.any():
        raise UserError(
            f"{where}: the replay of {path} is unstable at steps of {grid.step:g} s: check the gains of `drive` in "
            "recording.json against the model's inertia, and the effects"
        )
    return {
        axis: AxisReplay(position[:, k] / gears[k], torque[:, k] * gears[k], course.loops)
        for k, (axis, course) in enumerate(courses.items())
    }


def _grid(recording: Recording) -> _Grid:
    """Steps no longer than the emulator's and than the drive's servo period; the shortest of those, where axes differ."""
    told = [info.drive.servo_period for info in recording.info.axes.values() if info.drive and info.drive.servo_period]
    servo = min(told, default=SERVO_PERIOD)
    row = ceil(recording.info.sample_period / min(servo, SERVO_PERIOD) - 1e-6)
    step = recording.info.sample_period / row
    return _Grid(step, max(1, round(servo / step)), row)


def _course(where: str, recording: Recording, axis: str, loops: Loops, grid: _Grid) -> _Course:
    columns, count = recording.columns[axis], len(recording.time)
    if "position" not in columns:
        raise UserError(f"{where}: no column position: a replay begins where the recording does; record it")
    at = grid.rows(count)
    demand = np.zeros((len(at), 4))
    if loops.loop is Loop.POSITION:
        demand[:, POSITION] = np.interp(at, np.arange(count), _finite(where, columns, "position_demand"))
        demand[:, VELOCITY] = _slope(demand[:, POSITION], grid.period)
    elif loops.loop is Loop.VELOCITY:
        demand[:, VELOCITY] = np.interp(at, np.arange(count), _finite(where, columns, "velocity_demand"))
    held = at.astype(np.intp)
    for name, column in (("velocity_offset", VELOCITY_OFFSET), ("torque_offset", TORQUE_OFFSET)):
        if name in columns and loops.loop is not Loop.TORQUE:
            demand[:, column] = np.nan_to_num(columns[name])[held]
    if loops.loop is Loop.TORQUE:
        demand[:, TORQUE_OFFSET] = np.interp(at, np.arange(count), _finite(where, columns, "torque"))
    position, velocity = _start(columns["position"], recording.info.sample_period)
    torque = float(columns["torque"][0]) if "torque" in columns else None
    return _Course(loops, demand, position, velocity, torque)


def _finite(where: str, columns: dict[str, Array], name: str) -> Array:
    if name not in columns:
        raise UserError(f"{where}: no column {name}: a replay moves by it; record it, or tell another `law` of the drive")
    if wrong := np.flatnonzero(~np.isfinite(columns[name])).tolist():
        raise UserError(f"{where}: {name} row {wrong[0] + 1} is no number; a replay needs it in every row")
    return columns[name]


def _slope(demand: Array, period: float) -> Array:
    """Of a line that reaches each value at its time (n,): what the drive's interpolation tells its velocity loop."""
    slope = np.diff(demand, prepend=demand[0]) / period
    slope[0] = slope[1] if len(slope) > 1 else 0.0
    return np.asarray(slope)


def _start(position: Array, period: float) -> tuple[float, float]:
    """Position and velocity at the first row: a cubic through the first of them takes the noise off the velocity."""
    rows = min(len(position), max(FEWEST, ceil(START / period)))
    if rows < FEWEST:
        return float(position[0]), 0.0
    time = np.arange(rows) * period
    return float(position[0]), float(np.polynomial.Polynomial.fit(time, position[:rows], 3).deriv()(0.0))


def _servos(courses: list[_Course], mechanism: Mechanism, gears: Array, grid: _Grid) -> ServoBank:
    """The drives' loops as they are in the middle of the motion with which the recording begins."""
    servos = ServoBank(len(courses), seed=0, length=grid.period)
    servos.brakes[:] = False
    mechanism.brakes[:] = False
    mechanism.read()
    for k, (course, gear) in enumerate(zip(courses, gears, strict=True)):
        loops, state, speed = course.loops, servos.state[k], course.velocity * gear
        loops.write(servos.parameters[k], gear, grid.period)
        servos.loops[k] = loops.loop
        state["position"] = mechanism.motor_position[k] - speed * grid.period
        state["velocity"] = speed
        if course.torque is not None:
            state["torque"] = course.torque / gear
            if loops.integrates:
                state["integral"] = (course.torque - _without_integral(course)) / gear
    equip(servos, mechanism.dynamics.values(), grid.period)
    return servos


def _without_integral(course: _Course) -> float:
    """Torque that the loops ask for at the start, but for the integral's [N·m or N]."""
    loops, (position, velocity, more, torque) = course.loops, course.demand[0]
    error = position - course.position if loops.loop is Loop.POSITION else 0.0
    ahead = loops.velocity_feedforward * velocity if loops.loop is Loop.POSITION else velocity
    wanted = loops.position_gain * error + ahead + more
    return float(loops.velocity_gain * (wanted - course.velocity) + loops.position_stiffness * error + torque)


def _of_motor(demand: Array, gear: float) -> Array:
    return np.asarray(demand * np.array([gear, gear, gear, 1.0 / gear]))


def _run(mechanism: Mechanism, servos: ServoBank, demands: Array, grid: _Grid, count: int) -> tuple[Array, Array]:
    """Motor position and reported torque (count, n) at the recording's rows, by demands (m, n, 4) of the motors."""
    position, torque = np.empty((2, count, demands.shape[1]))
    for tick in range((count - 1) * grid.row + 1):
        mechanism.read()
        if tick % grid.servo == 0:
            servos.demand[0] = demands[tick // grid.servo]
            servos.run(0, mechanism.motor_position, mechanism.motor_torque)
        if tick % grid.row == 0:
            position[tick // grid.row] = mechanism.motor_position
            torque[tick // grid.row] = servos.state["torque_actual"]
        mechanism.step()
    return position, torque
