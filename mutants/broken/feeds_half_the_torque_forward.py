"""Feeds forward half of the torque that the motion needs."""

from __future__ import annotations

from drivetwin.controller.feedforward.torque_model import ModelTorque
from drivetwin.controller.joint_path import JointPath, Rows
from drivetwin.mutants.base import CaughtBy
from drivetwin.mutants.surgery import replace

CAUGHT_BY = CaughtBy("07_feed_forward.gain", "feed_forward")


def break_controller() -> None:
    torque = ModelTorque.__call__

    def broken(self: ModelTorque, path: JointPath) -> Rows:
        return 0.5 * torque(self, path)

    replace(ModelTorque, "__call__", broken)
