"""The arm for which moves are planned: its geometry, and its axes from axes.yaml."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.controller.joint_path import limits_of
from drivetwin.controller.machine import Machine, load_machine
from drivetwin.motion.jerk_limited import MotionLimits
from wafer_handler.scara.geometry import Geometry, Travel, load_geometry, travel_of
from wafer_handler.scara.kinematics import forward


@dataclass(frozen=True)
class Arm:
    """Geometry and axes of a wafer handler."""

    geometry: Geometry
    machine: Machine

    @property
    def limits(self) -> tuple[MotionLimits, MotionLimits, MotionLimits]:
        """Speed, acceleration and jerk of lift, rotate, stretch."""
        lift, rotate, stretch = (limits_of(self.machine.axes[name]) for name in ("lift", "rotate", "stretch"))
        return lift, rotate, stretch

    @property
    def travel(self) -> Travel:
        """Travel of lift, rotate, stretch."""
        return travel_of(self.machine)

    @property
    def folded_reach(self) -> float:
        """Distance of the tool point from the column where stretch stands at the start of its travel [m]."""
        return float(forward(self.geometry, np.array([0.0, 0.0, self.travel.stretch[0]])).y)


def load_arm() -> Arm:
    """The machine of docs/wafer-handler.md; raises UserError where a file of it is wrong."""
    return Arm(load_geometry(), load_machine("scara"))
