"""Tool and joints, accelerations included, against the plant's model in MuJoCo."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_tool import plant_tool
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.tool_motion import ToolMotion, joint_path, tool_acceleration

from drivetwin.controller.joint_path import JointPath

PERIOD = 0.001
GEOMETRY = load_arm().geometry

positions = st.tuples(st.floats(0.01, 0.34), st.floats(-2.8, 2.8), st.floats(0.13, 1.37))
velocities = st.tuples(st.floats(-0.25, 0.25), st.floats(-2.5, 2.5), st.floats(-2.0, 2.0))
accelerations = st.tuples(st.floats(-2.5, 2.5), st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
paths = st.builds(
    lambda position, velocity, acceleration: JointPath(
        PERIOD, np.array([position]), np.array([velocity]), np.array([acceleration])
    ),
    positions,
    velocities,
    accelerations,
)


@given(path=paths)
@settings(max_examples=100, deadline=None)
def test_the_tools_acceleration_is_the_plants(path: JointPath) -> None:
    np.testing.assert_allclose(tool_acceleration(GEOMETRY, path), plant_tool(path).acceleration, atol=1e-12)


@given(path=paths)
@settings(max_examples=100, deadline=None)
def test_the_joints_of_the_plants_tool_are_those_that_moved_it(path: JointPath) -> None:
    tool = plant_tool(path)
    joints = joint_path(GEOMETRY, ToolMotion(tool.position, tool.velocity, tool.acceleration), PERIOD)
    np.testing.assert_allclose(joints.position, path.position, atol=1e-12)
    np.testing.assert_allclose(joints.velocity, path.velocity, atol=1e-12)
    np.testing.assert_allclose(joints.acceleration, path.acceleration, atol=1e-10)
