"""The published figures of EMPS, and what is known of the EPOS lead screw."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.io import loadmat

from drivetwin.identification import AxisIdentification, Model, identify
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo

CARRIAGE = """
<mujoco model="emps"><worldbody><body>
  <joint name="carriage" type="slide" axis="1 0 0" damping="100" frictionloss="10"/>
  <inertial pos="0 0 0" mass="80" diaginertia="1 1 1"/>
</body></worldbody></mujoco>
"""
SCREW = """
<mujoco model="screw"><worldbody><body>
  <joint name="screw" type="hinge" axis="0 0 1" armature="2e-7"/>
  <inertial pos="0 0 0" mass="0.02" diaginertia="1e-7 1e-7 1e-7"/>
</body></worldbody></mujoco>
"""
RPM = 2.0 * np.pi / 60.0


@pytest.fixture(scope="module")
def carriage(emps: Path) -> AxisIdentification:
    model = Model(mujoco.MjModel.from_xml_string(CARRIAGE))
    fitted, held = _emps(emps / "DATA_EMPS.mat"), _emps(emps / "DATA_EMPS_PULSES.mat")
    return identify(model, [fitted], [held]).axes["carriage"]


@pytest.fixture(scope="module")
def screw(epos: Path) -> AxisIdentification:
    model = Model(mujoco.MjModel.from_xml_string(SCREW))
    return identify(model, [_epos(path) for path in sorted(epos.glob("*.csv"))]).axes["screw"]


def test_emps_symmetric_fit_is_the_published_one(carriage: AxisIdentification) -> None:
    value = {name: parameter.value for name, parameter in carriage.parameters.items()}
    assert value["inertia"] == pytest.approx(95.1089, rel=0.01)
    assert value["viscous"] == pytest.approx(203.5034, rel=0.01)
    assert value["coulomb"] == pytest.approx(20.3935, rel=0.01)
    assert value["offset"] == pytest.approx(-3.1648, rel=0.05)
    assert carriage.relative_error <= 0.0409
    assert carriage.validation_relative_error is not None
    assert carriage.validation_relative_error <= 0.0599


def test_emps_friction_depends_on_the_direction(carriage: AxisIdentification) -> None:
    value = {name: parameter.value for name, parameter in carriage.parameters.items()}
    assert carriage.direction is not None
    assert carriage.direction.real
    assert carriage.relative_error_directional is not None
    assert carriage.relative_error_directional <= 0.0312
    assert value["viscous_positive"] == pytest.approx(166.7, rel=0.01)
    assert value["viscous_negative"] == pytest.approx(240.4, rel=0.01)


def test_emps_names_no_stribeck(carriage: AxisIdentification) -> None:
    assert not carriage.stribeck.real
    assert "static_torque" not in carriage.parameters


def test_epos_curve_has_its_stribeck_minimum(screw: AxisIdentification) -> None:
    assert screw.stribeck.real
    assert screw.minimum_velocity is not None
    assert 40.0 <= screw.minimum_velocity / RPM <= 50.0


def test_epos_load_is_an_offset_and_the_inertia_cannot_be_told(screw: AxisIdentification) -> None:
    low, high = screw.parameters["offset"].interval
    assert low < high < 0.0
    forwards, backwards = screw.parameters["coulomb_positive"], screw.parameters["coulomb_negative"]
    assert forwards.value < backwards.value
    assert "2 is kept" in screw.unidentifiable["stribeck_exponent"]
    assert screw.parameters["stribeck_velocity"].value == pytest.approx(2.64, rel=0.02)
    assert "inertia" not in screw.parameters
    assert "accelerates" in screw.unidentifiable["inertia"]


def test_epos_has_a_stroke_at_every_speed(screw: AxisIdentification) -> None:
    speeds = {round(stroke.velocity / RPM / 10.0) * 10 for stroke in screw.strokes if abs(stroke.velocity) > 5 * RPM}
    assert speeds == {sign * speed for sign in (1, -1) for speed in (*range(10, 101, 10), *range(120, 201, 20))}


def _emps(path: Path) -> Recording:
    data = loadmat(path)
    torque, position = 35.1507 * data["vir"].ravel(), data["qm"].ravel()
    info = RecordingInfo(machine="emps", sample_period=1e-3, axes={"carriage": AxisInfo(joint="carriage")})
    time = np.arange(len(torque), dtype=np.float64) * 1e-3
    return Recording(path.stem, info, time, {"carriage": {"torque": torque, "position": position}})


def _epos(path: Path) -> Recording:
    lines = path.read_text(encoding="latin-1").splitlines()
    start = lines.index("ms;rpm;%") + 1
    table = np.array([[float(text) for text in line.split(";")[:3]] for line in lines[start:] if line.strip()])
    period = float(table[1, 0] - table[0, 0]) / 1e3
    info = RecordingInfo(machine="screw", sample_period=period, axes={"screw": AxisInfo(joint="screw")})
    columns = {"torque": -table[:, 2] / 100.0 * 9.84e-3, "velocity": -table[:, 1] * RPM}
    return Recording(path.stem, info, np.arange(len(table), dtype=np.float64) * period, {"screw": columns})
