"""What the drive of an axis is asked along a recording, at each of its servo periods, and how the axis begins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from drivetwin.emulator.drive.servo import POSITION, SERVO_PERIOD, TORQUE_OFFSET, VELOCITY, VELOCITY_OFFSET, Loop
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Interpolation, Recording
from drivetwin.twin.loops import Loops

Array = NDArray[np.float64]

Drawn = Callable[[Array, Array], Array]
"""How samples (n,) go on between rows (m,)."""

START = 0.02
"""Of a recording [s]: its position there tells the velocity with which an axis begins."""
FEWEST = 5
"""Rows that tell it at least."""
LONGEST_CYCLE = 0.004
"""Of a bus, from set-point to set-point of which a drive draws a line [s]: slower rows are a log's."""


@dataclass(frozen=True)
class Grid:
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
class Course:
    """Demand (m, 4) of an axis at every servo period as the servo takes it, and how the axis begins; joint side."""

    loops: Loops
    demand: Array
    position: float
    velocity: float
    torque: float | None


LEAST_SERVO_PERIOD = 1e-6
"""The loops of no drive are faster [s]; with steps as short as a file may say, a replay would not end."""


def grid_of(recording: Recording) -> Grid:
    """Steps no longer than the emulator's and than the drive's servo period; the shortest of those, where axes differ.

    Raises UserError for a servo period below `LEAST_SERVO_PERIOD`.
    """
    drives = {name: info.drive for name, info in recording.info.axes.items() if info.drive is not None}
    for name, drive in drives.items():
        if 0.0 < (drive.servo_period or 0.0) < LEAST_SERVO_PERIOD:
            raise UserError(
                f"{recording.name}: axes.{name}.drive.servo_period is {drive.servo_period:g} s; "
                f"expected {LEAST_SERVO_PERIOD:g} s or more: it is in seconds"
            )
    told = [drive.servo_period for drive in drives.values() if drive.servo_period]
    servo = min(told, default=SERVO_PERIOD)
    row = ceil(recording.info.sample_period / min(servo, SERVO_PERIOD) - 1e-6)
    step = recording.info.sample_period / row
    return Grid(step, max(1, round(servo / step)), row)


def course_of(where: str, recording: Recording, axis: str, loops: Loops, grid: Grid, drawn: Drawn) -> Course:
    """Of an axis, its demanded position `drawn` between rows.

    Raises UserError, beginning with `where`, for a column that the loops need and that is not there.
    """
    columns, count = recording.columns[axis], len(recording.time)
    if "position" not in columns:
        raise UserError(f"{where}: no column position: a replay begins where the recording does; record it")
    at = grid.rows(count)
    demand = np.zeros((len(at), 4))
    if loops.loop is Loop.POSITION:
        samples = _finite(where, columns, "position_demand")
        demand[:, POSITION] = drawn(samples, at)
        ahead = drawn(samples, np.minimum(at + loops.feedforward_lead / recording.info.sample_period, count - 1.0))
        demand[:, VELOCITY] = _slope(ahead, grid.period)
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
    return Course(loops, demand, position, velocity, torque)


def as_interpolated(recording: Recording, axis: str) -> Drawn:
    """As the drive goes on from row to row, a line if nothing is told; smooth where the rows are further apart than a bus's."""
    drive = recording.info.axes[axis].drive
    told = drive.interpolation if drive is not None else None
    smooth = told is Interpolation.CUBIC_SPLINE or recording.info.sample_period > LONGEST_CYCLE
    return curve if smooth else line


def line(samples: Array, at: Array) -> Array:
    """Samples (n,) at rows `at` (m,) and between them, as a drive draws them from cycle to cycle of its bus."""
    return np.interp(at, np.arange(len(samples)), samples)


def curve(samples: Array, at: Array) -> Array:
    """Samples (n,) at rows `at` (m,) and between them, of what is smooth: a cubic spline. A line's corners would be torque.

    At 100 rows a second and 2 Hz a line is 0.13 % short of an amplitude, and a velocity loop asks for many times its share.
    """
    count = len(samples)
    return np.asarray(CubicSpline(np.arange(count), samples)(at)) if count >= FEWEST else line(samples, at)


def _finite(where: str, columns: dict[str, Array], name: str) -> Array:
    if name not in columns:
        raise UserError(f"{where}: no column {name}: a replay needs it; record it, or give another `law` of the drive")
    if wrong := np.flatnonzero(~np.isfinite(columns[name])).tolist():
        raise UserError(f"{where}: {name} row {wrong[0] + 1} is not a number; a replay needs it in every row")
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


def without_integral(course: Course) -> float:
    """Torque that the loops ask for at the start, but for the integral's [N·m or N]."""
    loops, (position, velocity, more, torque) = course.loops, course.demand[0]
    error = position - course.position if loops.loop is Loop.POSITION else 0.0
    ahead = loops.velocity_feedforward * velocity if loops.loop is Loop.POSITION else velocity
    wanted = loops.position_gain * error + ahead + more
    return float(loops.velocity_gain * (wanted - course.velocity) + loops.position_stiffness * error + torque)


def of_motor(demand: Array, gear: float) -> Array:
    """A demand (m, 4) on the motor's side."""
    return np.asarray(demand * np.array([gear, gear, gear, 1.0 / gear]))
