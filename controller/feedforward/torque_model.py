"""The torque that a planned motion needs: the nominal model's, corrected by the torque of one run of that motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.controller.drive_node import DriveNode
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.controller.machine import POSITION_UNIT
from drivetwin.motion.filtering import zero_phase
from drivetwin.motion.inverse_dynamics import Model
from drivetwin.recording.recording import Recording

CUTOFF = 60.0
"""Frequency up to which torques are compared [Hz]."""


@dataclass(frozen=True)
class ModelTorque:
    """Call it with a path (n, axes) for its torque (n, axes) [N·m or N].

    `joints` are those of the axes; `corrections` (axes, 4): inertia beyond the model's, viscous and Coulomb friction, offset.
    """

    model: Model
    joints: tuple[str, ...]
    corrections: Rows

    def __call__(self, path: JointPath) -> Rows:
        torque = self.model.torques(self.joints, path.position, path.velocity, path.acceleration)
        columns = [_regressors(path, axis) @ self.corrections[axis] for axis in range(len(self.joints))]
        return np.asarray(torque + np.column_stack(columns))


def fitted(model: Model, drives: Sequence[DriveNode], path: JointPath, recording: Recording) -> ModelTorque:
    """The model with the corrections that explain, by least squares, the torques (n, axes) of a recording of `path`.

    The demand comes `setpoint_delay` cycles after its set-point, and the measured motion is close to the demand.
    """
    joints = tuple(drive.axis.joint for drive in drives)
    rigid = model.torques(joints, path.position, path.velocity, path.acceleration)
    corrections = []
    for axis, drive in enumerate(drives):
        late = drive.setpoint_delay
        measured = zero_phase(recording.columns[drive.name]["torque"], path.period, CUTOFF)[late:]
        beyond = measured - zero_phase(rigid[:, axis], path.period, CUTOFF)[: len(measured)]
        columns = _regressors(path, axis)[: len(measured)]
        moving = columns[:, 2] != 0.0
        corrections.append(np.linalg.lstsq(columns[moving], beyond[moving], rcond=None)[0])
    return ModelTorque(model, joints, np.array(corrections))


def _regressors(path: JointPath, axis: int) -> Rows:
    """Acceleration, velocity, its sign (0 where no set-point moves), 1: (n, 4)."""
    velocity = path.velocity[:, axis]
    sign = np.where(np.abs(velocity) < POSITION_UNIT / path.period, 0.0, np.sign(velocity))
    return np.column_stack([path.acceleration[:, axis], velocity, sign, np.ones(len(velocity))])
