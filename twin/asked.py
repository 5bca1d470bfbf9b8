"""The torque that a drive's loops asked for, from the recorded demand and the recorded position, where none was recorded.

A replay asks where a model goes that the loops drive. This asks the same loops, with the recorded position in the place of the
model's, and nothing of the model is in it. To first order a position error is this torque less the model's, through the closed
loop's compliance; both are the same samples seen through one linear operator.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import Loop, ServoBank, servo_period
from drivetwin.foundation.compiled import compiled
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Recording
from drivetwin.twin.course import Course, Grid, course_of, curve, grid_of
from drivetwin.twin.loops import Loops, loops_of

Array = NDArray[np.float64]


def loops_by_position(recording: Recording, axis: str, model: mujoco.MjModel) -> Loops:
    """The loops that move an axis by a demand of its position.

    Raises UserError where no loops are known, or they are moved by something else.
    """
    where = f"{recording.files[0] if recording.files else recording.name}: axis {axis}: no torque was recorded, so that"
    loops = loops_of(f"{where} the demanded torque has to come from the drive's loops", recording.info.axes[axis], model)
    if loops.loop is not Loop.POSITION:
        raise UserError(
            f"{where} it has to follow from position_demand, which the {loops.told_by} does not use: record {axis}.torque, or "
            "give the `drive` that follows the demand (docs/formats.md)"
        )
    return loops


def asked(recording: Recording, axis: str, loops: Loops) -> Array:
    """Torque (n,) [N·m or N] at the recording's rows that `loops` ask for, behind the commissioned lag of the current loop.

    An integral begins at 0: where there is one, the torque is known but for a constant.
    """
    where = f"{recording.files[-1] if recording.files else recording.name}: axis {axis}"
    grid = grid_of(recording)
    course = course_of(where, recording, axis, loops, grid, curve)
    return _along(course, grid, recording.columns[axis]["position"])


def _along(course: Course, grid: Grid, position: Array) -> Array:
    """The loops' torque while the position goes as it was recorded (n,)."""
    at = grid.rows(len(position))
    servos = ServoBank(1, seed=0, length=grid.period)
    course.loops.write(servos.parameters[0], 1.0, grid.period)
    servos.loops[:] = course.loops.loop
    servos.state["position"] = course.position - course.velocity * grid.period
    servos.state["velocity"] = course.velocity
    parameters, state, loops, *_ = servos.take_cycle()
    fine = _followed(parameters, state, loops, course.demand, curve(position, at), grid.period)
    return np.asarray(np.interp(np.arange(len(position)), at, fine))


@compiled
def _followed(parameters, state, loops, demand, position, length):  # type: ignore[no-untyped-def]
    """Torque (m,) at the end of every servo period, by demand (m, 4) and position (m,)."""
    torque, given, quiet = np.empty(len(position)), np.zeros(1), np.zeros(1)
    for k in range(len(position)):
        servo_period(parameters, state, loops, demand[k : k + 1], quiet, position[k : k + 1], given, length)
        torque[k] = given[0]
    return torque
