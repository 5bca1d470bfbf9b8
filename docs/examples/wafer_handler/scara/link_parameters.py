"""Masses, centres of mass and inertias of the arm's bodies, as its model (MJCF) has them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.motion.inverse_dynamics import read_mjcf
from wafer_handler.scara.geometry import BELTS, JOINTS


@dataclass(frozen=True)
class Body:
    """A body seen from above: mass [kg], centre along and across the link from its joint [m], Izz about the centre [kg·m²]."""

    mass: float
    along: float
    across: float
    inertia: float

    @property
    def about_joint(self) -> float:
        """Moment of inertia about the vertical axis of the body's own joint [kg·m²]."""
        return self.inertia + self.mass * (self.along**2 + self.across**2)


@dataclass(frozen=True)
class LinkParameters:
    """What the dynamics is made of: the carriage [kg], the four bodies that turn, the motors' inertias at the joints.

    `armature` are those of lift [kg], rotate and stretch [kg·m²]: rotor inertia times gear ratio squared.
    """

    carriage: float
    hub: Body
    upper_arm: Body
    forearm: Body
    blade: Body
    armature: tuple[float, float, float]

    @property
    def bodies(self) -> tuple[Body, Body, Body, Body]:
        """Hub, upper arm, forearm, blade."""
        return self.hub, self.upper_arm, self.forearm, self.blade


def from_model(path: Path) -> LinkParameters:
    """The link parameters of an MJCF model with the bodies carriage, hub, upper_arm, forearm, blade, x along each link.

    Raises UserError where it cannot be read, or a body or joint is missing.
    """
    model = read_mjcf(path)
    at_joints = np.array([model.dof_armature[_index(path, model, mujoco.mjtObj.mjOBJ_JOINT, name)] for name in JOINTS])
    lift, rotate, stretch = (float(value) for value in at_joints @ BELTS**2)
    return LinkParameters(
        carriage=float(model.body_mass[_index(path, model, mujoco.mjtObj.mjOBJ_BODY, "carriage")]),
        hub=_body(path, model, "hub"),
        upper_arm=_body(path, model, "upper_arm"),
        forearm=_body(path, model, "forearm"),
        blade=_body(path, model, "blade"),
        armature=(lift, rotate, stretch),
    )


def _body(path: Path, model: mujoco.MjModel, name: str) -> Body:
    index = _index(path, model, mujoco.mjtObj.mjOBJ_BODY, name)
    axes = np.empty(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[index])
    vertical = axes.reshape(3, 3)[2]
    along, across, _ = (float(value) for value in model.body_ipos[index])
    return Body(float(model.body_mass[index]), along, across, float(vertical**2 @ model.body_inertia[index]))


def _index(path: Path, model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    index = mujoco.mj_name2id(model, kind, name)
    if index < 0:
        raise UserError(f"{path} has no {kind.name[6:].lower()} '{name}', which the wafer handler's dynamics is made of")
    return int(index)
