"""A public robot model's bare rigid bodies are those of the model."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from drivetwin.blind.wide.robots import draw_robot, robot_files
from drivetwin.foundation.errors import UserError

ROBOT = """<mujoco><compiler angle="degree"/><worldbody><body name="base" pos="0 0 0.3" euler="20 0 0">
<geom size=".1" mass="3"/>
<body name="upper" pos="0 0.1 0.2" euler="0 30 0"><joint name="a" axis="0 1 0.2" range="-90 120" limited="true" ref="10"/>
 <inertial pos="0.02 0.1 0.2" mass="2" fullinertia="0.02 0.03 0.025 0.001 -0.002 0.003"/>
 <body name="bracket" pos="0 0 0.3" euler="0 0 40"><geom type="box" size=".05 .1 .02" mass="0.7"/>
  <body name="fore" pos="0 0.05 0.1"><joint name="b" axis="1 0 0" pos="0 0.01 0" frictionloss="0.8" armature="0.05"/>
   <geom type="capsule" fromto="0 0 0 0 0.1 0.3" size="0.03" mass="1.1"/>
   <body name="finger" pos="0 0 0.35"><joint name="free_finger" type="slide"/><geom size="0.02" mass="0.2"/></body>
  </body></body></body></body></worldbody>
<actuator><motor joint="a"/><position joint="b"/></actuator></mujoco>"""


def test_mass_matrix_and_weight_are_those_of_the_original(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "robot.xml").write_text(ROBOT, encoding="utf-8")
    (tmp_path / "part.xml").write_text("<mujocoinclude/>", encoding="utf-8")
    assert robot_files(tmp_path) == ("robots/deep/robot.xml",)
    machine = draw_robot(np.random.default_rng(0), "robots/deep/robot.xml", tmp_path)
    own, other = (mujoco.MjModel.from_xml_string(text) for text in (machine.xml(), ROBOT))
    turned = np.array([0.4, -0.7])
    masses, biases = [], []
    for model in (own, other):
        data = mujoco.MjData(model)
        data.qpos[:2] = model.qpos0[:2] + turned
        data.qvel[:2] = 0.5, -1.0
        model.dof_armature[:] = 0.0
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        masses.append(mass[:2, :2])
        biases.append(data.qfrc_bias[:2])
    assert masses[0] == pytest.approx(masses[1], rel=1e-5)
    assert biases[0] == pytest.approx(biases[1], rel=1e-5)
    assert (machine.nominal[1].coulomb, machine.nominal[1].rotor) == (0.8, 0.05)


def test_folder_without_robots_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no MJCF"):
        robot_files(tmp_path)
