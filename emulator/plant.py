"""The plant: a machine's mechanism with its true effects, moved by the drives' torque."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.assembly import DrivenJoint, working_plant
from drivetwin.emulator.drive.interpolation import fill_demands
from drivetwin.emulator.drive.servo import SERVO_PERIOD, ServoBank, filter_share, servo_period
from drivetwin.emulator.dynamics import AxisDynamics, FrictionLaw
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.incidents import Incidents
from drivetwin.emulator.machine import Axis, Machine
from drivetwin.emulator.mechanism import Mechanism, act, read
from drivetwin.foundation.compiled import in_place, settled
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.mujoco_calls import mj_step

_UNSTABLE = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
    mujoco.mjtWarning.mjWARN_BADCTRL,
)
"""Warnings after which MuJoCo has gone on with another state or torque; one after the other in its table."""

_NONE = np.zeros(len(_UNSTABLE), dtype=np.int32).tobytes()



@in_place
def run_periods(  # type: ignore[no-untyped-def]  # record arrays have no static type
    first, last, periods, drives, motor_position, motor_torque, misreadings, reading, acting, brakes, time, length, model, data
) -> None:
    """Servo periods `first` to `last` of a cycle of `periods`: encoders, loops, torque, friction, one step of the plant each.

    `drives` is what `ServoBank.take_cycle` gives, `reading` and `acting` are the mechanism's. `misreadings` (n,) [rad] are what
    the encoders are off by in the last period; `time` [s] is that of the plant, which steps by `length` [s].
    """
    parameters, state, loops, demand, noise, trace = drives
    parts, moving, constants = acting
    for period in range(first, last):
        read(*reading)
        if period == periods - 1:
            for axis in range(misreadings.shape[0]):
                motor_position[axis] += misreadings[axis]
                misreadings[axis] = 0.0
        servo_period(parameters, state, loops, demand[period], noise[period], motor_position, motor_torque, length)
        for axis in range(state.shape[0]):
            trace[period, axis] = state[axis].position
        act(parts, moving, constants, motor_torque, brakes, time)
        mj_step(model, data)
        time += length


@in_place
def run_cycle(  # type: ignore[no-untyped-def]  # record arrays have no static type
    courses, first, last, periods, drives, sensors, reading, acting, brakes, time, length, model, data
) -> None:
    """As `run_periods`, of which `sensors` are three; before the first one the demand of the `courses` is filled."""
    if first == 0:
        fill_demands(courses, drives[3][:periods], length)
    position, torque, misreadings = sensors
    run_periods(first, last, periods, drives, position, torque, misreadings, reading, acting, brakes, time, length, model, data)


class Plant:
    """The mechanism of one machine, stepped at the servo period.

    Knows the truth. Drives see it through `motor_position` only; nothing here is reachable from the bus. `incidents` are what
    befalls it while it runs.
    """

    def __init__(self, machine: Machine, effects: tuple[PlacedEffect, ...], model: Path | None = None) -> None:
        """`model` is an MJCF file in the place of the machine's own. Raises UserError where it lacks an axis of the machine."""
        drives = {name: _drive(axis) for name, axis in machine.axes.items()}
        as_it_stands = model is None and machine.built_in
        path = machine.model_path if model is None else model
        spec = mujoco.MjSpec.from_file(str(path)) if as_it_stands else working_plant(path, drives, SERVO_PERIOD)
        spec.option.timestep = SERVO_PERIOD
        self._mechanism = Mechanism(spec, drives, effects)
        self.incidents = Incidents(self._mechanism)
        self.model, self.data = self._mechanism.model, self._mechanism.data
        self._addresses = self.model._address, self.data._address
        self._warnings = self.data.warning.number[_UNSTABLE[0] : _UNSTABLE[-1] + 1]  # a view of the counters
        self.motor_position, self.motor_torque = self._mechanism.motor_position, self._mechanism.motor_torque
        self._run_cycle: Callable[..., None] | None = None

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    def joint_positions(self) -> NDArray[np.float64]:
        """True joint positions (n,) [rad or m]; for the limit switches and the tests."""
        return self._mechanism.joint_positions()

    def joint_velocities(self) -> NDArray[np.float64]:
        """True joint velocities (n,) [rad/s or m/s]."""
        return self._mechanism.joint_velocities()

    def equip(self, servos: ServoBank) -> None:
        """Let the drives' loops have the power stages that they truly have: what limits and delays the measured current too."""
        equip(servos, self._mechanism.dynamics.values())

    def rehearse(self, servos: ServoBank) -> None:
        """Compile a cycle, which takes seconds at first, and run none."""
        self._run(servos, servos.rehearsal(), 0, 0)

    def advance(self, servos: ServoBank) -> None:
        """Run `servos.periods` servo periods: encoder, loops, torque, friction, one step of the plant each.

        Raises UserError where the plant cannot be simulated at the servo period; MuJoCo has set it back to its start then.
        """
        mechanism = self._mechanism
        if self.incidents.rising:
            self.incidents.raise_friction()
        drives = servos.take_cycle()
        if not mechanism.resistances.present:
            self._run(servos, drives, 0, servos.periods)
        else:  # what is written in Python is asked before each step
            for first in range(servos.periods):
                mechanism.resistances.evaluate()
                self._run(servos, drives, first, first + 1)
        if self._warnings.tobytes() != _NONE:  # a tenth of what any() takes, each cycle
            raise UserError(self._unstable())

    def _run(self, servos: ServoBank, drives: tuple[NDArray[Any], ...], first: int, last: int) -> None:
        """Servo periods `first` to `last` of a cycle of `drives`, as they have been taken."""
        arguments = (
            *(servos.courses, first, last, servos.periods, drives),
            (self.motor_position, self.motor_torque, self.incidents.misreadings),
            *(self._mechanism.reading, self._mechanism.acting, servos.brakes, self.data.time, SERVO_PERIOD, *self._addresses),
        )
        if self._run_cycle is None:
            self._run_cycle = settled(run_cycle, *arguments)
        self._run_cycle(*arguments)

    def _unstable(self) -> str:
        """What MuJoCo has warned of, and what to do."""
        warned = [kind.name for kind, number in zip(_UNSTABLE, self._warnings, strict=True) if number]
        return (
            f"the simulation of the machine is unstable ({', '.join(warned)}): its model or its true "
            f"effects are stiffer or larger than steps of {1e6 * SERVO_PERIOD:g} us can follow; give a --truth or a model "
            "of this machine"
        )

    def truth(self) -> dict[str, dict[str, float]]:
        """True parameters of each axis as they are now: inertia at qpos0 (motor included) and friction; joint side, SI.

        Told only by the emulator's owner, after a fit; never on the bus.
        """
        return {
            name: {"inertia": float(inertia), **told(law)}
            for inertia, (name, law) in zip(self._mechanism.inertia, self._mechanism.friction_laws().items(), strict=True)
        }


def equip(servos: ServoBank, axes: Iterable[AxisDynamics], period: float = SERVO_PERIOD) -> None:
    """Power stages of the axes in loops that run every `period` [s]."""
    for parameters, axis in zip(servos.parameters, axes, strict=True):
        parameters["current_limit"] = axis.motor.current_limit / axis.gear_ratio
        if axis.motor.bandwidth > 0.0:
            parameters["current_filter"] = filter_share(1.0 / (2.0 * np.pi * axis.motor.bandwidth), period)


def _drive(axis: Axis) -> DrivenJoint:
    return DrivenJoint(
        joint=axis.joint,
        actuator=axis.actuator,
        gear_ratio=axis.gear_ratio,
        rotor_inertia=axis.motor.inertia,
        holding_brake=axis.motor.holding_brake,
        position=axis.power_on_position,
    )


def told(law: FrictionLaw) -> dict[str, float]:
    """A friction law by the names that an identification uses; Stribeck's only where the law has it."""
    names = {
        "coulomb": law.coulomb,
        "viscous": law.viscous,
        "coulomb_positive": law.coulomb + law.coulomb_asymmetry,
        "coulomb_negative": law.coulomb - law.coulomb_asymmetry,
        "viscous_positive": law.viscous + law.viscous_asymmetry,
        "viscous_negative": law.viscous - law.viscous_asymmetry,
    }
    if law.stribeck_velocity > 0.0:
        names |= {
            "static_torque": law.static_torque,
            "stribeck_velocity": law.stribeck_velocity,
            "exponent": law.exponent,
        }
    return names


def truth_path(machine: Machine, given: Path | None) -> Path:
    """The effects file that is the plant's truth: the given one, or the machine's own."""
    return given if given is not None else machine.effects_path
