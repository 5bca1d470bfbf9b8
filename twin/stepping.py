"""The steps of a replay, compiled: encoders, the drives' loops, torque, friction, one step of MuJoCo each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import ServoBank, servo_period
from drivetwin.emulator.mechanism import Mechanism, act, read
from drivetwin.foundation.compiled import in_place
from drivetwin.foundation.mujoco_calls import mj_step
from drivetwin.twin.course import Grid

Array = NDArray[np.float64]

AT_ONCE = 4096
"""Steps without Python in between: some 20 ms, after which a replay can be interrupted."""


@in_place
def run_steps(  # type: ignore[no-untyped-def]  # record arrays have no static type
    first, last, servo, row, drives, noise, sensors, reading, acting, brakes, time, period, step, model, data, told
) -> None:
    """Steps `first` to `last`: of these, every `servo`-th begins a servo period, and every `row`-th is a row that is told.

    `drives`: parameters, state, loops and demands (m, n, 4) of the servos, `noise` (n,) of their torque; `sensors`: motor
    position and torque (n,); `reading`, `acting` and `brakes` (n,) are the mechanism's, at a `time` [s]; `period` of the servos
    and `step` are in s; `model` and `data` are addresses. `told`: motor position and reported torque at each row (count, n).
    """
    parameters, state, loops, demands = drives
    motor_position, motor_torque = sensors
    position, torque = told
    parts, moving, constants = acting
    for tick in range(first, last):
        read(*reading)
        if tick % servo == 0:
            servo_period(parameters, state, loops, demands[tick // servo], noise, motor_position, motor_torque, period)
        if tick % row == 0:
            for axis in range(state.shape[0]):
                position[tick // row, axis] = motor_position[axis]
                torque[tick // row, axis] = state[axis].torque_actual
        act(parts, moving, constants, motor_torque, brakes, time)
        mj_step(model, data)
        time += step


@dataclass(frozen=True)
class Stepping:
    """A mechanism and the drives that move it."""

    mechanism: Mechanism
    servos: ServoBank
    grid: Grid

    def run(self, demands: Array, count: int) -> tuple[Array, Array]:
        """Motor position [rad] and reported torque [N·m], (count, n) each, at a recording's rows, by demands (m, n, 4)."""
        mechanism, servos, grid = self.mechanism, self.servos, self.grid
        position, torque = np.empty((2, count, demands.shape[1]))
        drives, noise = (servos.parameters, servos.state, servos.loops, demands), np.zeros(demands.shape[1])
        moving = (mechanism.motor_position, mechanism.motor_torque), mechanism.reading, mechanism.acting, mechanism.brakes
        addresses = mechanism.model._address, mechanism.data._address
        steps = (count - 1) * grid.row + 1
        at_once = 1 if mechanism.resistances.present else AT_ONCE  # what is written in Python is asked before each step
        for first in range(0, steps, at_once):
            mechanism.resistances.evaluate()
            span = first, min(first + at_once, steps), grid.servo, grid.row
            time = mechanism.data.time, grid.period, grid.step
            run_steps(*span, drives, noise, *moving, *time, *addresses, (position, torque))
        return position, torque
