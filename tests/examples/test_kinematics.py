"""Kinematics of the wafer handler against MuJoCo's forward kinematics, against itself, and against the paper's misprints."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, pi, sin
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wafer_handler.scara.geometry import BELT_OFFSET, BELTS, JOINTS, Travel, load_geometry, travel_of
from wafer_handler.scara.kinematics import Pose, chain, forward, inverse, jacobian, links

from drivetwin.controller.machine import load_machine
from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Samples

PLANT = Path(__file__).parents[2] / "emulator" / "machines" / "scara" / "scara.xml"
GEOMETRY = load_geometry()
TRAVEL = travel_of(load_machine("scara"))

in_travel = st.tuples(*(st.floats(*ends) for ends in (TRAVEL.lift, TRAVEL.rotate, TRAVEL.stretch))).map(np.array)


def random_joints(count: int) -> Samples:
    ends = np.array([TRAVEL.lift, TRAVEL.rotate, TRAVEL.stretch])
    return np.random.default_rng(0).uniform(ends[:, 0], ends[:, 1], (count, 3))


def test_forward_is_where_mujoco_has_the_tool() -> None:
    model = mujoco.MjModel.from_xml_path(str(PLANT))
    data, joints = mujoco.MjData(model), random_joints(2000)
    pose, frames = forward(GEOMETRY, joints), chain(links(GEOMETRY, joints))
    address = [model.joint(name).qposadr[0] for name in JOINTS]
    for row, stand in enumerate(joints):
        data.qpos[address] = BELTS @ stand + BELT_OFFSET
        mujoco.mj_kinematics(model, data)
        place, turn = data.site("tool").xpos, data.site("tool").xmat.reshape(3, 3)
        np.testing.assert_allclose([pose.x[row], pose.y[row], pose.z[row]], place, rtol=0, atol=1e-12)
        np.testing.assert_allclose([np.cos(pose.yaw[row]), np.sin(pose.yaw[row]), 0], turn[:, 0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(frames[row, :3, 3], place, rtol=0, atol=1e-12)
        np.testing.assert_allclose(frames[row, :3, :3], turn, rtol=0, atol=1e-12)


@given(in_travel)
def test_inverse_of_forward_is_the_identity(joints: Samples) -> None:
    np.testing.assert_allclose(inverse(GEOMETRY, forward(GEOMETRY, joints), TRAVEL), joints, rtol=0, atol=1e-9)


def test_inverse_takes_many_poses_at_once() -> None:
    joints = random_joints(1000)
    np.testing.assert_allclose(inverse(GEOMETRY, forward(GEOMETRY, joints), TRAVEL), joints, rtol=0, atol=1e-9)


def test_jacobian_is_the_derivative_of_forward() -> None:
    joints, step = random_joints(200), 1e-6
    columns = []
    for axis in np.eye(3):
        ahead, behind = forward(GEOMETRY, joints + step * axis), forward(GEOMETRY, joints - step * axis)
        columns.append(np.stack([ahead.x - behind.x, ahead.y - behind.y, ahead.z - behind.z], axis=-1) / (2 * step))
    np.testing.assert_allclose(jacobian(GEOMETRY, joints), np.stack(columns, axis=-1), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("x", "y", "z", "reason"),
    [
        (0.0, 0.64, 0.8, r"too far: it lies 0\.64 m from the column, the blade reaches 0\.63196\d m"),
        (0.1, 0.2, 0.8, r"too near: it lies 0\.223607 m .* the folded arm reaches 0\.29185\d m"),
        (0.0, 0.5, 1.2, r"lift would stand at 0\.51 m, its travel is 0\.01 \.\. 0\.34 m"),
        (0.05, -0.5, 0.8, r"rotate would stand at -3\.04\d+ rad, its travel is -2\.8 \.\. 2\.8 rad"),
    ],
)
def test_targets_out_of_travel_are_refused_with_the_reason(x: float, y: float, z: float, reason: str) -> None:
    with pytest.raises(UserError, match=reason):
        inverse(GEOMETRY, outwards(x, y, z), TRAVEL)


def outwards(x: float, y: float, z: float) -> Pose:
    """The pose of a blade that points from the column to the target."""
    return Pose(np.asarray(x), np.asarray(y), np.asarray(z), np.arctan2(y, x))


def test_without_a_travel_the_arm_s_own_reach_is_the_limit() -> None:
    inverse(GEOMETRY, outwards(0.0, 0.64, 0.8))
    with pytest.raises(UserError, match=r"too far: it lies 0\.641 m from the column, the blade reaches 0\.64 m"):
        inverse(GEOMETRY, outwards(0.0, 0.641, 0.8))
    long_blade = replace(GEOMETRY, blade=0.5)
    with pytest.raises(UserError, match=r"too near: it lies 0\.09 m from the column along the blade, .* 0\.1 m"):
        inverse(long_blade, outwards(0.0, 0.09, 0.8))


def test_a_pose_whose_yaw_contradicts_its_place_is_refused_by_how_much() -> None:
    pose = forward(GEOMETRY, np.array([0.1, 0.3, 0.9]))
    turned = replace(pose, yaw=pose.yaw + 0.01)
    reach = float(np.hypot(pose.x, pose.y))
    with pytest.raises(UserError, match=rf"at {reach * sin(0.01):.4g} m, .* this one is turned 0\.01 rad from it"):
        inverse(GEOMETRY, turned)


def test_conditioning_near_the_stretched_arm_is_as_documented() -> None:
    for stretch, error in ((1.37, 1e-9), (pi / 2, 1e-10)):
        pose = forward(GEOMETRY, np.array([0.1, 0.0, stretch]))
        found = inverse(GEOMETRY, replace(pose, y=pose.y - error))[2]
        singular, regular = (error / GEOMETRY.arm) ** 0.5, error / (2 * GEOMETRY.arm * cos(stretch))
        assert stretch - found == pytest.approx(min(singular, regular), rel=1e-3)


# The misprints of the paper (docs/wafer-handler.md, "Errata of the paper"): what it prints, and why it cannot be.


def test_erratum_sign_of_theta3_in_theta5() -> None:
    """Printed theta5 = -90 deg - theta3: the blade turns by -2 theta3 and the tool leaves the line of the closed form."""
    joints = random_joints(200)
    table = links(GEOMETRY, joints)
    assert np.allclose(table[4].theta, -pi / 2 + joints[:, 2])
    printed = (*table[:4], replace(table[4], theta=-pi / 2 - joints[:, 2]), table[5])
    closed, frame = forward(GEOMETRY, joints), chain(printed)
    yaw = np.arctan2(frame[:, 1, 0], frame[:, 0, 0])
    np.testing.assert_allclose(np.exp(1j * yaw), np.exp(1j * (closed.yaw - 2 * joints[:, 2])), rtol=0, atol=1e-12)
    miss = np.hypot(frame[:, 0, 3] - closed.x, frame[:, 1, 3] - closed.y)
    np.testing.assert_allclose(miss, 2 * GEOMETRY.blade * np.sin(joints[:, 2]), rtol=0, atol=1e-12)


def test_erratum_raise_is_d1_plus_d3() -> None:
    """Printed as the lift's stroke: p_z - d4 - d5, which is d1 + d3."""
    table = links(GEOMETRY, random_joints(50))
    d1, height = table[0].d, chain(table)[:, 2, 3]
    np.testing.assert_allclose(height - GEOMETRY.d4 - GEOMETRY.d5, d1 + GEOMETRY.d3, rtol=0, atol=1e-12)
    np.testing.assert_allclose(height - GEOMETRY.d3 - GEOMETRY.d4 - GEOMETRY.d5, d1, rtol=0, atol=1e-12)


def test_erratum_blade_length_dropped_in_theta3() -> None:
    """Printed asin((-s2 p_x + c2 p_y) / (2 L3)): not theta3, and without a value for most of the travel."""
    joints = random_joints(200)
    pose = forward(GEOMETRY, joints)
    printed = (-np.sin(joints[:, 1]) * pose.x + np.cos(joints[:, 1]) * pose.y) / (2 * GEOMETRY.arm)
    np.testing.assert_allclose(printed, np.sin(joints[:, 2]) + GEOMETRY.blade / (2 * GEOMETRY.arm), rtol=0, atol=1e-12)
    ends = np.array(TRAVEL.stretch)
    undefined_from = asin(1 - GEOMETRY.blade / (2 * GEOMETRY.arm))
    assert (ends[1] - undefined_from) / (ends[1] - ends[0]) > 0.75


def test_erratum_asin_is_unique_only_between_its_ends() -> None:
    """A pose has two arms, theta3 and 180 deg - theta3; that the inverse is unique is the travel's doing."""
    joints = random_joints(50)
    mirrored = joints * [1, 1, -1] + [0, 0, pi]
    here, there = forward(GEOMETRY, joints), forward(GEOMETRY, mirrored)
    np.testing.assert_allclose([here.x, here.y, here.yaw], [there.x, there.y, there.yaw], rtol=0, atol=1e-12)
    assert mirrored[:, 2].min() > pi / 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("arm: [", "is not YAML"),
        ("", "the file: "),
        ("{arm: 0.2, blade: 0.24, column: 0.5, d3: 0.1, d4: 0.1}", "d5: Field required"),
        ("{arm: -0.2, blade: 0.24, column: 0.5, d3: 0.1, d4: 0.1, d5: 0}", "arm: .* greater than 0; it holds -0.2"),
        ("{arm: .inf, blade: 0.24, column: 0.5, d3: 0.1, d4: 0.1, d5: 0}", "arm: Input should be a finite number"),
        ("{arm: '0.2', blade: 0.24, column: 0.5, d3: 0.1, d4: 0.1, d5: 0}", "arm: Input should be a valid number"),
        ("{arm: 0.2, blade: 0.24, column: 0.5, d3: 0.1, d4: 0.1, d5: 0, d6: 1}", "d6: Unexpected keyword"),
    ],
)
def test_wrong_geometry_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "geometry.yaml"
    path.write_text(text)
    with pytest.raises(UserError, match=message):
        load_geometry(path)


def test_missing_geometry_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no geometry at"):
        load_geometry(tmp_path / "geometry.yaml")


def test_travel_is_that_of_the_axes() -> None:
    assert Travel(lift=(0.01, 0.34), rotate=(-2.8, 2.8), stretch=(0.13, 1.37)) == TRAVEL
