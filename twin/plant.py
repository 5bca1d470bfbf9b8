"""The emulator's mechanism of a model, with motors on the axes of a recording and nothing else that moves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco

from drivetwin.emulator.assembly import DrivenJoint, working_plant
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.model_tree import free_name
from drivetwin.emulator.mechanism import Mechanism
from drivetwin.foundation.errors import UserError
from drivetwin.motion.coupled_motion import check_axes_move_alone
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.motion.model_file import motors_of, named_model
from drivetwin.recording.recording import AxisInfo


def mechanism_of(
    path: Path,
    axes: Mapping[str, AxisInfo],
    start: Mapping[str, float],
    effects: tuple[PlacedEffect, ...],
    period: float,
) -> Mechanism:
    """The mechanism of an MJCF file at time steps of `period` [s]; the axes begin at `start` [rad or m].

    Raises UserError for an axis that is on no joint of the model, or moves with what was not recorded.
    """
    _, model = named_model(path)
    drives = {axis: _driven(path, model, axis, info, start[axis]) for axis, info in axes.items()}
    joints = {axis: drive.joint for axis, drive in drives.items()}
    check_axes_move_alone(Model(model, path), joints)
    return Mechanism(working_plant(path, drives, period), drives, effects)


def _driven(path: Path, model: mujoco.MjModel, axis: str, info: AxisInfo, start: float) -> DrivenJoint:
    joints = {model.joint(number).name: number for number in range(model.njnt)}
    if info.joint not in joints:
        raise UserError(f"{path} has no joint {info.joint!r} for axis {axis}; it has {', '.join(joints) or 'none'}")
    motors = motors_of(model, joints[info.joint])
    taken = {model.actuator(number).name for number in range(model.nu)}
    actuator = info.actuator if info.actuator in motors else motors[0] if motors else free_name(info.joint, taken)
    own = float(model.actuator(motors[0]).gear[0]) if motors else 1.0
    gear = abs(info.gear_ratio or own or 1.0)
    return DrivenJoint(info.joint, actuator, gear, rotor_inertia=0.0, holding_brake=0.0, position=start)
