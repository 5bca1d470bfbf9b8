"""Moves a model as a machine moved: from the recorded start, by the recorded demand, through the drive's loops."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import ServoBank
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.mechanism import Mechanism
from drivetwin.emulator.plant import equip
from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.recording.recording import Recording
from drivetwin.twin.course import Course, Grid, as_interpolated, course_of, grid_of, of_motor, without_integral
from drivetwin.twin.loops import Loops, loops_of
from drivetwin.twin.plant import mechanism_of
from drivetwin.twin.stepping import Stepping

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AxisReplay:
    """Position (n,) [rad or m] and torque (n,) [N·m or N] that the simulated drive tells at the recording's times."""

    position: Array
    torque: Array
    loops: Loops


def replay(path: Path, recording: Recording, effects: tuple[PlacedEffect, ...]) -> dict[str, AxisReplay]:
    """Run the model of an MJCF file with these effects through a recording; by axis.

    Row k of the recording is the servo period that begins at its time: its position, demand and torque. Between rows the demand
    is what the drive interpolates, a straight line if nothing is told, and of a log slower than any bus a smooth curve; offsets
    stay. The axes begin where their encoders read the
    recorded position, at the recorded velocity, and at the recorded torque where an integral can hold it. Raises UserError
    where recording and model do not say enough, and where the simulation is unstable.
    """
    where = str(recording.files[0] if recording.files else recording.name)
    columns = str(recording.files[-1] if recording.files else recording.name)
    model = read_mjcf(path)
    axes = recording.info.axes
    grid = grid_of(recording)
    courses = {axis: _course(where, columns, recording, axis, model, grid) for axis in axes}
    start = {axis: course.position for axis, course in courses.items()}
    mechanism = mechanism_of(path, axes, start, effects, grid.step)
    begins = {axis: each.encoder.joint_at(start[axis], each.gear_ratio) for axis, each in mechanism.dynamics.items()}
    if begins != start:
        mechanism = mechanism_of(path, axes, begins, effects, grid.step)
    mechanism.set_velocities(np.array([course.velocity for course in courses.values()]))
    gears = np.array([axis.gear_ratio for axis in mechanism.dynamics.values()])
    servos = _servos(list(courses.values()), mechanism, gears, grid)
    demands = np.stack([of_motor(course.demand, gear) for course, gear in zip(courses.values(), gears, strict=True)], axis=1)
    position, torque = Stepping(mechanism, servos, grid).run(demands, len(recording.time))
    if not np.isfinite(position).all() or mechanism.data.warning.number.any():
        raise UserError(
            f"{where}: the replay of {path} is unstable at steps of {grid.step:g} s: check the gains of `drive` in "
            "recording.json against the model's inertia, and the effects"
        )
    return {
        axis: AxisReplay(position[:, k] / gears[k], torque[:, k] * gears[k], course.loops)
        for k, (axis, course) in enumerate(courses.items())
    }


def _course(where: str, columns: str, recording: Recording, axis: str, model: mujoco.MjModel, grid: Grid) -> Course:
    """`where` its drive is written, and in which file its `columns` are, for what is refused."""
    loops = loops_of(f"{where}: axis {axis}", recording.info.axes[axis], model)
    return course_of(f"{columns}: axis {axis}", recording, axis, loops, grid, as_interpolated(recording, axis))


def _servos(courses: list[Course], mechanism: Mechanism, gears: Array, grid: Grid) -> ServoBank:
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
                state["integral"] = (course.torque - without_integral(course)) / gear
    equip(servos, mechanism.dynamics.values(), grid.period)
    return servos
