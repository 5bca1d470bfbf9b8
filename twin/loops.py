"""The drive's loops that a recording describes, or the model's own actuators, as the emulator's servo closes them."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivetwin.emulator.drive.servo import Loop, filter_share
from drivetwin.foundation.errors import UserError
from drivetwin.motion.model_file import ON_JOINT
from drivetwin.recording.recording import AxisInfo, DriveLaw, DriveLoops

PID_GAINS = ("proportional_gain", "integral_gain", "derivative_gain")
"""Of a `drive` with law `pid` or `pd_position_servo` [N·m/rad, N·m/(rad·s), N·m·s/rad; N/m, N/(m·s), N·s/m]."""
FINEST = 1e-12
"""Steps of encoder and current sensor [rad, N·m]: none, for the loops see what is finer than the recorded column."""


@dataclass(frozen=True)
class Loops:
    """Loops of one axis on the joint side, SI; `told_by` says where they are from.

    torque = velocity_gain (position_gain e + velocity_feedforward d' - v) + integrals + position_stiffness e + torque offset,
    with the demand d, the following error e = d - q and the filtered velocity v; `integral_rate` [1/s] integrates the velocity
    error, `position_integral` [N·m/(rad·s)] the following error. `feedforward_lead` [s] is how far d' is ahead of the backward
    difference over a servo period.
    """

    loop: Loop
    told_by: str
    position_gain: float = 0.0
    velocity_gain: float = 0.0
    integral_rate: float = 0.0
    velocity_feedforward: float = 0.0
    feedforward_lead: float = 0.0
    position_stiffness: float = 0.0
    position_integral: float = 0.0
    velocity_filter_hz: float | None = None
    torque_limit: float = inf
    current_time_constant: float = 0.0

    @property
    def integrates(self) -> bool:
        """Whether it holds a torque without an error."""
        return self.integral_rate > 0.0 or self.position_integral > 0.0

    def answer(self, frequency: NDArray[np.float64], inertia: float) -> NDArray[np.complex128]:
        """Share of a torque that disturbs an axis of an inertia [kg·m² or kg] that the drive gives against it, by frequency
        (n,) [Hz], demand and speed steady: the complementary sensitivity C / (J s² + C) at the axis's input.

        Astrom and Murray, Feedback Systems, 2008, sec. 11.1. Without the delay of a servo period.
        """
        s = 2j * pi * frequency
        filtered = 1.0 + s / (2.0 * pi * self.velocity_filter_hz) if self.velocity_filter_hz else 1.0
        speed_loop = self.velocity_gain * (self.position_gain + s / filtered) * (1.0 + self.integral_rate / s)
        stiffness = speed_loop + self.position_stiffness + self.position_integral / s
        given = stiffness / (1.0 + s * self.current_time_constant)
        return np.asarray(given / (inertia * s**2 + given))

    def write(self, parameters: Any, gear: float, period: float) -> None:
        """Fill a servo's parameters, which are the motor's, for servo periods of `period` [s]."""
        parameters["position_gain"] = self.position_gain
        parameters["velocity_gain"] = self.velocity_gain / gear**2
        parameters["integral_rate"] = self.integral_rate
        parameters["velocity_feedforward"] = self.velocity_feedforward
        parameters["position_stiffness"] = self.position_stiffness / gear**2
        parameters["position_integral"] = self.position_integral / gear**2
        lag = 1.0 / (2.0 * pi * self.velocity_filter_hz) if self.velocity_filter_hz else 0.0
        parameters["velocity_filter"] = filter_share(lag, period)
        parameters["current_filter"] = filter_share(self.current_time_constant, period)
        parameters["torque_limit"] = self.torque_limit / gear
        parameters["encoder_quantum"] = parameters["torque_quantum"] = FINEST


def loops_of(where: str, info: AxisInfo, model: mujoco.MjModel) -> Loops:
    """The loops that `drive` of recording.json tells, or else the actuator that `model` has on the joint.

    Raises UserError where neither closes a loop, or a gain is missing.
    """
    told = None if info.drive is None else told_loops(where, info.drive)
    return _of_actuator(where, info, model) if told is None else told


def told_loops(where: str, drive: DriveLoops) -> Loops | None:
    """The loops of a `drive`; None where its law is not told. Raises UserError for a gain that is missing."""
    return None if drive.law is DriveLaw.UNKNOWN else _LAWS[drive.law](where, drive)


def _cascade(where: str, drive: DriveLoops) -> Loops:
    if drive.position_gain is None or drive.velocity_gain is None:
        raise UserError(f"{where}: drive: a cascade needs position_gain and velocity_gain; write both, or another `law`")
    return Loops(
        Loop.POSITION,
        "cascade of the recording's drive",
        position_gain=drive.position_gain,
        velocity_gain=drive.velocity_gain,
        integral_rate=1.0 / drive.integral_time if drive.integral_time else 0.0,
        velocity_feedforward=drive.velocity_feedforward,
        feedforward_lead=drive.velocity_feedforward_lead or 0.0,
        **_power_stage(drive),
    )


def _pid(where: str, drive: DriveLoops) -> Loops:
    proportional, integral, derivative = _pid_gains(where, drive, PID_GAINS)
    return Loops(
        Loop.POSITION,
        "PID loop of the recording's drive",
        velocity_gain=derivative,
        velocity_feedforward=drive.velocity_feedforward,
        position_stiffness=proportional,
        feedforward_lead=drive.velocity_feedforward_lead or 0.0,
        position_integral=integral,
        **_power_stage(drive),
    )


def _pd_position_servo(where: str, drive: DriveLoops) -> Loops:
    proportional, _, derivative = _pid_gains(where, drive, (PID_GAINS[0], PID_GAINS[2]))
    return Loops(
        Loop.POSITION,
        "PD position servo of the recording's drive",
        velocity_gain=derivative,
        position_stiffness=proportional,
        **_power_stage(drive),
    )


def _pid_gains(where: str, drive: DriveLoops, needed: tuple[str, ...]) -> list[float]:
    """`PID_GAINS`, 0 for those that are not needed."""
    told = drive.model_extra or {}
    gains = []
    for name in PID_GAINS:
        gain = told.get(name) if name in needed else 0.0
        if isinstance(gain, bool) or not isinstance(gain, (int, float)) or not (np.isfinite(gain) and gain >= 0.0):
            raise UserError(f"{where}: drive: law {drive.law.value} needs {name}, a number of 0 or more; it is {gain!r}")
        gains.append(float(gain))
    return gains


def _torque(where: str, drive: DriveLoops) -> Loops:  # noqa: ARG001  # as the others
    return Loops(Loop.TORQUE, "torque as recorded, no loop", **_power_stage(drive))


_LAWS = {
    DriveLaw.CASCADE: _cascade,
    DriveLaw.PID: _pid,
    DriveLaw.PD_POSITION_SERVO: _pd_position_servo,
    DriveLaw.TORQUE: _torque,
}


def _power_stage(drive: DriveLoops) -> dict[str, Any]:
    return {
        "velocity_filter_hz": drive.velocity_filter_hz or None,
        "torque_limit": drive.torque_limit or inf,
        "current_time_constant": drive.current_loop_time_constant or 0.0,
    }


def _of_actuator(where: str, info: AxisInfo, model: mujoco.MjModel) -> Loops:
    """A `position` or `velocity` actuator of MJCF; force = gain ctrl + bias, over gear times the joint."""
    on_joint = {int(kind) for kind in ON_JOINT}
    joint = model.joint(info.joint).id
    mine = [
        number
        for number in range(model.nu)
        if int(model.actuator_trntype[number]) in on_joint and int(model.actuator_trnid[number, 0]) == joint
    ]
    for number in sorted(mine, key=lambda each: model.actuator(each).name != info.actuator):
        found = _servo(model, number)
        if found is not None:
            return found
    raise UserError(
        f"{where}: no loop is known: recording.json has no `drive` with gains, and joint {info.joint!r} of the model no "
        "position or velocity actuator; write `drive` (docs/formats.md)"
    )


def _servo(model: mujoco.MjModel, number: int) -> Loops | None:
    gear, gain = float(model.actuator_gear[number, 0]), float(model.actuator_gainprm[number, 0])
    _, by_position, by_velocity = (float(value) for value in model.actuator_biasprm[number, :3])
    affine = int(model.actuator_biastype[number]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    plain = int(model.actuator_dyntype[number]) == int(mujoco.mjtDyn.mjDYN_NONE)
    name = model.actuator(number).name
    limit = float(model.actuator_forcerange[number, 1]) * abs(gear) if model.actuator_forcelimited[number] else inf
    damping = -by_velocity * gear**2
    if affine and plain and by_position == -gain and gain > 0.0:
        told = f"position actuator {name} of the model"
        return Loops(Loop.POSITION, told, velocity_gain=damping, position_stiffness=gain * gear**2, torque_limit=limit)
    if affine and plain and by_position == 0.0 and by_velocity == -gain and gain > 0.0:
        told = f"velocity actuator {name} of the model"
        return Loops(Loop.VELOCITY, told, velocity_gain=damping, torque_limit=limit)
    return None
