"""Inverse dynamics seen from the motors: friction left out, passive joints followed by their equality."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.identification import Model, load_model

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


def test_a_swing_between_the_samples_that_are_looked_at_is_not_missed() -> None:
    """Of 10 000 samples a pendulum stands in all but 40: closed form m g r cos(q) + (I + m r²) a."""
    xml = """<mujoco><worldbody><body><joint name="swing" axis="0 -1 0"/><inertial pos="0.5 0 0" mass="2" diaginertia="1 1 1"/>
    </body></worldbody></mujoco>"""
    position = np.zeros((10_000, 1))
    position[5_000:5_040, 0] = np.linspace(0.0, 1.2, 40)
    rest = np.zeros_like(position)
    torque = Model(mujoco.MjModel.from_xml_string(xml)).torques(["swing"], position, rest, rest)
    np.testing.assert_allclose(torque, 2.0 * 9.81 * 0.5 * np.cos(position), rtol=1e-9)


@pytest.mark.parametrize("where", ["first", "middle", "last"])
def test_a_spring_off_its_rest_for_one_sample_is_felt(where: str) -> None:
    xml = """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0" stiffness="300"/><geom size="0.1" mass="4"/>
    </body></worldbody></mujoco>"""
    position = np.zeros((5_000, 1))
    at = {"first": 0, "middle": 2_503, "last": 4_999}[where]
    position[at] = 0.01
    rest = np.zeros_like(position)
    torque = Model(mujoco.MjModel.from_xml_string(xml)).torques(["x"], position, rest, rest)
    np.testing.assert_allclose(torque, 300.0 * position, rtol=1e-9)


DIFFERENTIAL = """
<mujoco><option gravity="0 0 -10"/>
  <worldbody>
    <body><joint name="a" type="slide" axis="0 0 1"/><geom size="0.1" mass="1"/></body>
    <body><joint name="b" type="slide" axis="0 0 1"/><geom size="0.1" mass="2"/></body>
    <body><joint name="c" type="slide" axis="0 0 1" ref="0.4"/><geom size="0.1" mass="4"/></body>
    <body><joint name="d" type="slide" axis="0 0 1"/><geom size="0.1" mass="8"/></body>
  </worldbody>
  <tendon>
    <fixed name="sum"><joint joint="a" coef="1"/><joint joint="b" coef="3"/><joint joint="c" coef="-2"/></fixed>
    <fixed name="alone"><joint joint="d" coef="5"/></fixed>
  </tendon>
  <equality><tendon tendon1="sum"/></equality>
</mujoco>
"""


def test_a_joint_follows_two_others_by_a_tendon() -> None:
    """c = (a + 3 b) / 2: by virtual work a costs m_a + m_c c / 2 and b costs m_b + 3 m_c c / 2, with the weights."""
    model = Model(mujoco.MjModel.from_xml_string(DIFFERENTIAL))
    acceleration = np.random.default_rng(3).standard_normal((200, 2))
    rest = np.zeros_like(acceleration)
    torque = model.torques(["a", "b"], rest, rest, acceleration)
    load = 4.0 * (acceleration @ [0.5, 1.5] + 10.0)
    expected = [1.0, 2.0] * (acceleration + 10.0) + load[:, None] * [0.5, 1.5]
    np.testing.assert_allclose(torque, expected - [0.5 * 40.0 - 20.0, 1.5 * 40.0 - 60.0], rtol=1e-9)
    np.testing.assert_allclose(model.positions(["a", "b"], np.array([[0.2, 0.4]]))[0, 2], 0.4 + 0.7)


def test_a_tendon_that_leaves_two_joints_free_is_refused_by_their_names() -> None:
    model = Model(mujoco.MjModel.from_xml_string(DIFFERENTIAL))
    with pytest.raises(UserError, match="joints b, c with a recorded one"):
        model.inertia("a")
    assert model.inertia("d") == pytest.approx(8.0)


def test_one_tendon_follows_another() -> None:
    """5 d = 0.3 + 2 (a + 3 b - 2 c), and only d is not recorded."""
    xml = DIFFERENTIAL.replace('<tendon tendon1="sum"/>', '<tendon tendon1="alone" tendon2="sum" polycoef="0.3 2 0 0 0"/>')
    position = np.array([[0.1, 0.2, 0.45]])
    qpos = Model(mujoco.MjModel.from_xml_string(xml)).positions(["a", "b", "c"], position)
    assert qpos[0, 3] == pytest.approx((0.3 + 2.0 * (0.1 + 0.6 - 2.0 * 0.05)) / 5.0)


def test_a_joint_that_an_equality_holds_stands_there() -> None:
    held = LINKAGE.replace('joint2="shoulder" polycoef="0.1 -2 0.3 0 0"', 'polycoef="0.7 0 0 0 0"')
    qpos = Model(mujoco.MjModel.from_xml_string(held)).positions(["shoulder"], np.zeros((1, 1)))
    np.testing.assert_allclose(qpos, [[0.0, 0.7]])


@pytest.mark.parametrize("flag", ["equality", "constraint"])
def test_what_the_options_turn_off_is_not_followed(flag: str) -> None:
    off = LINKAGE.replace("<worldbody>", f'<option><flag {flag}="disable"/></option><worldbody>', 1)
    qpos = Model(mujoco.MjModel.from_xml_string(off)).positions(["shoulder"], np.ones((1, 1)))
    np.testing.assert_allclose(qpos, [[1.0, 0.0]])


def test_discrete_time_and_a_motor_s_own_damping_are_no_part_of_it() -> None:
    """MuJoCo's `invdiscrete` asks for the torque of one step of an integrator; a motion has accelerations."""
    xml = """<mujoco><option timestep="0.05" integrator="implicit" gravity="0 0 0"><flag invdiscrete="enable"/></option>
    <worldbody><body><joint name="x" type="slide" damping="50"/><geom size="0.1" mass="4"/></body></worldbody>
    <actuator><motor joint="x" gear="3" damping="2" armature="0.5"/></actuator></mujoco>"""
    motion = np.random.default_rng(1).standard_normal((50, 1))
    torque = Model(mujoco.MjModel.from_xml_string(xml)).torques(["x"], motion, motion, motion)
    np.testing.assert_allclose(torque, (4.0 + 9.0 * 0.5) * motion, rtol=1e-9)


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
