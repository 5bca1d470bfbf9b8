"""The Python API: each function against what neither it nor the code below it computed."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import can
import mujoco
import numpy as np
import pytest

import drivetwin
from drivetwin.foundation.errors import UserError
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo, Samples
from drivetwin.recording.writer import write_recording

PERIOD = 1e-3

TABLE = """<mujoco model="table"><option gravity="0 0 0" timestep="0.00025"/><worldbody><body name="table">
<joint name="rotate" type="hinge" axis="0 0 1" armature="0.2" frictionloss="0.5" damping="0.1"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
<actuator>{actuator}</actuator></mujoco>"""
MOTOR = '<motor name="rotate" joint="rotate"/>'
SERVO = '<position name="rotate" joint="rotate" kp="400" kv="30"/>'


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """0.3 kg·m² with 0.5 N·m of Coulomb friction and 0.1 N·m·s/rad, and a motor."""
    path = tmp_path / "table.xml"
    path.write_text(TABLE.format(actuator=MOTOR), encoding="utf-8")
    return path


def write(folder: Path, columns: dict[str, Samples]) -> Path:
    """A recording of the table."""
    axis = AxisInfo(joint="rotate", actuator="rotate", position_resolution=1e-7, torque_resolution=1e-3)
    info = RecordingInfo(machine="table", sample_period=PERIOD, axes={"rotate": axis})
    time = np.arange(len(columns["position"]), dtype=np.float64) * PERIOD
    write_recording(Recording(folder.name, info, time, {"rotate": columns}), folder)
    return folder


def test_a_name_costs_nothing_until_it_is_asked_for() -> None:
    told = "import drivetwin, sys; assert 'numpy' not in sys.modules; drivetwin.apply; assert 'numpy' in sys.modules"
    subprocess.run([sys.executable, "-c", told], check=True)
    with pytest.raises(AttributeError, match="module 'drivetwin' has no attribute 'emulated'"):
        drivetwin.emulated  # noqa: B018


def test_emulate_is_a_bus_for_any_master() -> None:
    """An expedited SDO upload (CiA 301, 7.2.4.3) of the device type: a servo drive, CiA 402-2, 6.1: 0002'0192h."""
    with drivetwin.emulate("stage", profile="cia402-full") as emulation:
        boot_up = emulation.bus.recv(1.0)
        assert boot_up is not None
        assert (boot_up.arbitration_id, bytes(boot_up.data)) == (0x701, b"\0")
        emulation.bus.send(can.Message(arbitration_id=0x601, data=bytes.fromhex("4000100000000000"), is_extended_id=False))
        answer = emulation.bus.recv(1.0)
        assert answer is not None
        assert (answer.arbitration_id, bytes(answer.data)) == (0x581, bytes.fromhex("4300100092010200"))
        assert list(emulation.machine.machine.axes) == ["slide"]


def test_identify_finds_what_only_the_plant_knows(tmp_path: Path) -> None:
    coulomb, viscous = {"value": 31.7, "unit": "N"}, {"value": 118.0, "unit": "N·s/m"}
    effects = [
        {"effect": name, "axis": "slide", "parameters": {name: value}}
        for name, value in (("coulomb", coulomb), ("viscous", viscous))
    ]
    truth = tmp_path / "truth.json"
    truth.write_text(json.dumps({"schema": "effects/1", "effects": effects}), encoding="utf-8")
    with drivetwin.emulate("stage", truth=truth) as emulation:
        law = drivetwin.identify("stage", emulation.bus, recordings=tmp_path / "kept").axes["slide"].law
    assert law.coulomb == pytest.approx(31.7, rel=0.02)
    assert law.viscous == pytest.approx(118.0, rel=0.02)
    kept = [read_recording(folder) for folder in sorted((tmp_path / "kept").iterdir())]
    assert [recording.name for (recording,) in kept] == ["excitation_slide", "strokes_slide", "validation_slide"]
    assert all({"position", "torque", "position_demand"} <= set(recording.columns["slide"]) for (recording,) in kept)


def test_identify_moves_no_real_machine() -> None:
    with pytest.raises(UserError, match="can0 may be a real machine: `drivetwin identify` asks for limits"):
        drivetwin.identify("stage", "can0", clock="realtime")


def test_import_recording_is_in_si_units(tmp_path: Path) -> None:
    (tmp_path / "scope.csv").write_text("t [ms];M [mN·m];q [deg]\n0;500;0\n1;250;90\n2;-1000;180\n", encoding="utf-8")
    columns = "torque: {column: M}, position: {column: q}"
    told = f"machine: bench\ntime: {{column: t}}\naxes: {{x: {{columns: {{{columns}}}}}}}\n"
    (tmp_path / "map.yaml").write_text(told, encoding="utf-8")
    recording = drivetwin.import_recording(tmp_path / "scope.csv", tmp_path / "map.yaml")
    assert recording.time == pytest.approx([0.0, 0.001, 0.002])
    assert recording.columns["x"]["torque"] == pytest.approx([0.5, 0.25, -1.0])
    assert recording.columns["x"]["position"] == pytest.approx([0.0, np.pi / 2.0, np.pi])


def test_diagnose_names_the_friction_that_the_model_lacks(table: Path, tmp_path: Path) -> None:
    """0.8 N·m in the recordings' formula, 0.5 N·m in the model."""

    def recorded(name: str, seconds: float, frequency: float) -> Path:
        angle = 2.0 * np.pi * frequency * np.arange(round(seconds / PERIOD)) * PERIOD
        rate = 2.0 * np.pi * frequency
        position = 0.7 * np.sin(angle) + 0.4 * np.sin(0.31 * angle + 1.0)
        velocity = rate * (0.7 * np.cos(angle) + 0.31 * 0.4 * np.cos(0.31 * angle + 1.0))
        acceleration = -(rate**2) * (0.7 * np.sin(angle) + 0.31**2 * 0.4 * np.sin(0.31 * angle + 1.0))
        noise = 0.01 * np.random.default_rng(len(name)).standard_normal(len(angle))
        torque = 0.3 * acceleration + 0.1 * velocity + 0.8 * np.sign(velocity) + noise
        return write(tmp_path / name, {"torque": torque, "position": position})

    found = drivetwin.diagnose(table, [recorded("fitted", 12.0, 0.25)], [recorded("held", 6.0, 0.4)])
    assert found.verdict == "explained"
    (added,) = found.selected
    assert (added.effect.name, added.axis) == ("coulomb", "rotate")
    assert found.causes[0].parameters["coulomb"].value == pytest.approx(0.8, abs=0.01)


def test_apply_writes_what_was_identified(table: Path, tmp_path: Path) -> None:
    parameters = {"coulomb": {"value": 0.8, "unit": "N·m"}, "viscous": {"value": 0.25, "unit": "N·m·s/rad"}}
    axes = {"rotate": {"joint": "rotate", "parameters": parameters}}
    identified = tmp_path / "identified.json"
    identified.write_text(json.dumps({"schema": "identified/1", "machine": "table", "axes": axes}), encoding="utf-8")
    twin = mujoco.MjModel.from_xml_string(drivetwin.apply(identified, table).xml)
    assert (twin.dof_frictionloss[0], twin.dof_damping[0]) == pytest.approx((0.8, 0.25))


def test_replay_moves_a_model_as_mujoco_does(tmp_path: Path) -> None:
    """MuJoCo's own position actuator, stepped here."""
    model = tmp_path / "servo.xml"
    model.write_text(TABLE.format(actuator=SERVO), encoding="utf-8")
    compiled = mujoco.MjModel.from_xml_path(str(model))
    data = mujoco.MjData(compiled)
    demand = 0.6 * np.sin(3.0 * np.arange(1500) * PERIOD) ** 2
    fine = np.interp(np.arange(4 * (len(demand) - 1) + 1) / 4.0, np.arange(len(demand)), demand)
    position, torque = np.empty((2, len(demand)))
    for tick, target in enumerate(fine):
        data.ctrl[:] = target
        at = float(data.qpos[0])
        mujoco.mj_step(compiled, data)
        if tick % 4 == 0:
            position[tick // 4], torque[tick // 4] = at, float(data.actuator_force[0])
    folder = write(tmp_path / "swings", {"torque": torque, "position": position, "position_demand": demand})
    (found,) = drivetwin.replay(model, [folder])
    assert found.recording == "swings"
    moved = found.axes["rotate"].runs["model"].signals["position"]
    assert np.sqrt(np.mean((moved - position) ** 2)) < 2e-4 * np.abs(position).max()
