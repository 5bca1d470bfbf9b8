"""Feeds forward half of the torque that the motion needs."""

from __future__ import annotations

from drivetwin.controller.feedforward.torque_model import ModelTorque
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import Original, instead_of

CAUGHT_BY = CaughtBy("07_feed_forward.gain", "feed_forward")


@instead_of(ModelTorque, "__call__")
def break_controller(torque: Original, self: ModelTorque, path: JointPath) -> Rows:
    rows: Rows = 0.5 * torque(self, path)
    return rows
