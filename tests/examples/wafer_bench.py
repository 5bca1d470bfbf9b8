"""A free wafer on the pads of a blade whose motion is given: MuJoCo's contact friction decides whether it slips."""

from __future__ import annotations

from math import cos, hypot, pi, sin

import mujoco
import numpy as np
from numpy.typing import NDArray
from plant_tool import plant_tool
from wafer_handler.scara.wafer import Wafer

from drivetwin.controller.joint_path import JointPath

_SETTLING = 0.2
"""Seconds in which the wafer settles on its pads before the motion starts."""

_HEAVY = 1e6
"""Mass [kg] and inertia [kg m²] of the blade: the wafer does not move it."""

_CONTACT = 'solref="0.004 1" solimp="0.99 0.99 0.001" condim="3"'
_THICKNESS = 0.000775


def slip(wafer: Wafer, path: JointPath) -> float:
    """The most that the wafer's edge moves on the blade while the plant's tool goes along `path` [m].

    The blade leans by the wafer's `tilt`, up towards +x. Elliptic friction cones and no-slip iterations leave less creep of
    MuJoCo's soft contacts than a tenth of a micrometre.
    """
    tool = plant_tool(path)
    model = mujoco.MjModel.from_xml_string(_model(wafer, path.period))
    data = mujoco.MjData(model)
    data.qpos[3] = tool.yaw[0]
    mujoco.mj_step(model, data, round(_SETTLING / path.period))
    start, moved = _on_blade(data), []
    for acceleration in np.column_stack([tool.acceleration @ _leaning(wafer.tilt), path.acceleration[:, 1]]):
        data.qfrc_applied[:4] = _HEAVY * acceleration
        mujoco.mj_step(model, data)
        x, y, turned = _on_blade(data) - start
        moved.append(hypot(x, y) + wafer.radius * abs(turned))
    return float(max(moved))


def _on_blade(data: mujoco.MjData) -> NDArray[np.float64]:
    """The wafer's x, y and angle in the blade's frame."""
    yaw = data.qpos[3]
    x, y = data.qpos[4:6] - data.qpos[:2]
    angle = 2.0 * np.arctan2(data.qpos[10], data.qpos[7])
    return np.array([cos(yaw) * x + sin(yaw) * y, cos(yaw) * y - sin(yaw) * x, (angle - yaw + pi) % (2.0 * pi) - pi])


def _leaning(tilt: float) -> NDArray[np.float64]:
    """World axes (rows) in the frame of a blade that leans up towards +x."""
    return np.array([[cos(tilt), 0.0, -sin(tilt)], [0.0, 1.0, 0.0], [sin(tilt), 0.0, cos(tilt)]])


def _model(wafer: Wafer, step: float) -> str:
    gravity = -9.81 * _leaning(wafer.tilt)[2]
    angles = 2.0 * pi * np.arange(wafer.pads) / wafer.pads
    friction = f'friction="{wafer.friction} 0 0"'
    pads = "".join(
        f'<geom type="sphere" size="0.005" pos="{wafer.pad_radius * cos(angle)} {wafer.pad_radius * sin(angle)} -0.005" '
        f'mass="0" {friction} {_CONTACT}/>'
        for angle in angles
    )
    return f"""
    <mujoco>
      <option timestep="{step}" gravity="{gravity[0]} {gravity[1]} {gravity[2]}" integrator="implicitfast"
              cone="elliptic" impratio="10" noslip_iterations="5" tolerance="1e-12"/>
      <worldbody>
        <body name="blade" gravcomp="1">
          <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>
          <joint type="hinge" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="{_HEAVY}" diaginertia="{_HEAVY} {_HEAVY} {_HEAVY}"/>
          {pads}
        </body>
        <body name="wafer" pos="0 0 {_THICKNESS / 2}">
          <freejoint/>
          <geom type="cylinder" size="{wafer.radius} {_THICKNESS / 2}" mass="0.128" {friction} {_CONTACT}/>
        </body>
      </worldbody>
    </mujoco>"""
