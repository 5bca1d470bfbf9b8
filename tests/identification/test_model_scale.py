"""A model whose masses are all wrong by the same share must not spoil the inertia."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
import synthetic

from drivetwin.identification import AxisIdentification, Model, identify
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo

PENDULUM = """
<mujoco model="pendulum"><worldbody><body>
  <joint name="swing" type="hinge" axis="0 1 0" armature="0.1"/>
  <inertial pos="0 0 -0.4" mass="{mass}" diaginertia="0.01 0.01 0.01"/>
</body></worldbody></mujoco>
"""
HOIST = """
<mujoco model="hoist"><worldbody><body>
  <joint name="swing" type="slide" axis="0 0 1" armature="0.1"/>
  <inertial pos="0 0 0" mass="{mass}" diaginertia="0.01 0.01 0.01"/>
</body></worldbody></mujoco>
"""


def test_scale_of_gravity_that_changes_with_the_pose_is_found() -> None:
    scaled = [_fit(PENDULUM, seed) for seed in range(10)]
    scale = np.mean([axis.parameters["model_scale"].value for axis in scaled])
    assert scale == pytest.approx(1.0 / 0.97, rel=0.005)
    true = _model(PENDULUM, 2.0).inertia("swing")
    inside = [low <= true <= high for low, high in (axis.parameters["inertia"].interval for axis in scaled)]
    assert sum(inside) >= 7


def test_constant_gravity_is_an_offset_and_has_no_scale() -> None:
    axis = _fit(HOIST, 0)
    assert "model_scale" not in axis.parameters
    assert axis.parameters["offset"].value == pytest.approx(0.06 * 9.81, abs=0.05)


def _model(xml: str, mass: float) -> Model:
    return Model(mujoco.MjModel.from_xml_string(xml.format(mass=mass)))


def _fit(xml: str, seed: int) -> AxisIdentification:
    """The plant has 2 kg, the model 3 % less."""
    rng = np.random.default_rng(seed)
    motions = (synthetic.strokes(), synthetic.sweep())
    recordings = [_record(_model(xml, 2.0), motion, str(number), rng) for number, motion in enumerate(motions)]
    return identify(_model(xml, 0.97 * 2.0), recordings).axes["swing"]


def _record(plant: Model, motion: synthetic.Motion, name: str, rng: np.random.Generator) -> Recording:
    columns = [values[:, None] for values in (motion.position, motion.velocity, motion.acceleration)]
    needed = plant.torques(["swing"], *columns)[:, 0]
    torque = needed + synthetic.PLAIN.torque(motion.velocity) + 0.1 * rng.standard_normal(len(needed))
    info = RecordingInfo(machine="test", sample_period=synthetic.PERIOD, axes={"swing": AxisInfo(joint="swing")})
    time = np.arange(len(torque), dtype=np.float64) * synthetic.PERIOD
    return Recording(name, info, time, {"swing": {"torque": torque, "position": motion.position}})
