"""Inverse dynamics seen from the motors: friction left out, passive joints followed by their equality."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from controller.identification import Model, load_model
from drivetwin.errors import UserError

LINKAGE = """
<mujoco model="linkage">
  <worldbody><body>
    <joint name="shoulder" type="hinge" axis="0 1 0" damping="3" frictionloss="2" armature="0.1"/>
    <inertial pos="0.3 0 0" mass="2" diaginertia="0.1 0.1 0.1"/>
    <body pos="0.5 0 0">
      <joint name="elbow" type="hinge" axis="0 1 0" damping="1"/>
      <inertial pos="0.2 0 0" mass="1" diaginertia="0.05 0.05 0.05"/>
    </body>
  </body></worldbody>
  <equality><joint joint1="elbow" joint2="shoulder" polycoef="0.1 -2 0.3 0 0"/></equality>
</mujoco>
"""


def test_power_of_the_axis_is_the_change_of_energy_of_all_joints() -> None:
    mj = mujoco.MjModel.from_xml_string(LINKAGE)
    time = np.arange(0.0, 1.0, 1e-3)
    q, v, a = np.sin(3 * time), 3 * np.cos(3 * time), -9 * np.sin(3 * time)
    torque = Model(mj).torques(["shoulder"], q[:, None], v[:, None], a[:, None])[:, 0]
    mj.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data = mujoco.MjData(mj)
    energy = np.empty(len(time))
    for row in range(len(time)):
        data.qpos[:] = q[row], 0.1 - 2 * q[row] + 0.3 * q[row] ** 2
        data.qvel[:] = v[row], (-2 + 0.6 * q[row]) * v[row]
        mujoco.mj_forward(mj, data)
        energy[row] = data.energy.sum()
    power = np.gradient(energy, time)
    assert np.abs(power - torque * v)[1:-1].max() < 1e-3 * np.abs(power).max()


def test_equality_named_the_other_way_round_is_turned() -> None:
    straight = LINKAGE.replace("0.1 -2 0.3 0 0", "0.1 -2 0 0 0")
    turned = straight.replace('joint1="elbow" joint2="shoulder"', 'joint1="shoulder" joint2="elbow"')
    turned = turned.replace("0.1 -2 0 0 0", "0.05 -0.5 0 0 0")
    motion = [np.linspace(-0.5, 0.5, 50)[:, None]] * 3
    torques = [Model(mujoco.MjModel.from_xml_string(xml)).torques(["shoulder"], *motion) for xml in (straight, turned)]
    np.testing.assert_allclose(torques[0], torques[1], atol=1e-9)


def test_constant_model_is_closed_form() -> None:
    xml = '<mujoco><worldbody><body><joint name="z" type="slide" axis="0 0 1" damping="9"/><geom size="0.1" mass="4"/>'
    model = Model(mujoco.MjModel.from_xml_string(xml + "</body></worldbody></mujoco>"))
    motion = np.random.default_rng(0).standard_normal((100_000, 1))
    torque = model.torques(["z"], motion, motion, motion)
    np.testing.assert_allclose(torque, 4.0 * (motion + 9.81), rtol=1e-9)
    assert model.inertia("z") == pytest.approx(4.0)


def test_unknown_joint_is_refused_with_those_there_are() -> None:
    model = Model(mujoco.MjModel.from_xml_string(LINKAGE))
    with pytest.raises(UserError, match=r"no hinge or slide joint 'wrist'.*shoulder, elbow"):
        model.inertia("wrist")


def test_bad_model_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no model at"):
        load_model(tmp_path / "missing.xml")
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco><worldbody>")
    with pytest.raises(UserError, match="not a MuJoCo model"):
        load_model(broken)
