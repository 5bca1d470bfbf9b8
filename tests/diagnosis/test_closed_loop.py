"""How far a diagnosis shrinks in closed loop, of a machine that MuJoCo alone has moved."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from gap_bench import stribeck_case
from rich.console import Console

from drivetwin.cli.diagnose_summary import print_summary
from drivetwin.diagnosis.report.closed_loop import in_closed_loop
from drivetwin.diagnosis.report.result import Array, Diagnosis
from drivetwin.diagnosis.report.schema import read_report
from drivetwin.diagnosis.report.write import write_diagnosis
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.viscous import Viscous
from drivetwin.recording.recording import Recording, RecordingInfo

BASE = stribeck_case(20.0)
AXIS = next(iter(BASE.axes))
PERIOD, ROWS, COUNT = 1e-3, 8, 1500
SERVO = '<position name="motor" joint="turn" kp="400" kv="30"/>'
DAMPING, TRUE_DAMPING = 0.8, 2.4
MODEL = """<mujoco><option timestep="0.000125" gravity="0 0 0"/><worldbody><body>
<joint name="turn" axis="0 0 1" damping="{damping}"/><inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body>
</worldbody><actuator>{actuator}</actuator></mujoco>"""


def write_model(folder: Path, actuator: str = SERVO) -> Path:
    path = folder / "turn.xml"
    path.write_text(MODEL.format(damping=DAMPING, actuator=actuator), encoding="utf-8")
    return path


def measured(*columns: str) -> Recording:
    """The machine, which has three times the damping, by MuJoCo and its own actuator."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(damping=TRUE_DAMPING, actuator=SERVO))
    data = mujoco.MjData(model)
    time = np.arange(COUNT, dtype=np.float64) * PERIOD
    demand = 0.6 * np.sin(3.0 * time) ** 2
    fine = np.interp(np.arange((COUNT - 1) * ROWS + 1) / ROWS, np.arange(COUNT), demand)
    position, torque = np.empty((2, COUNT))
    for tick, target in enumerate(fine):
        data.ctrl[0] = target
        at = float(data.qpos[0])
        mujoco.mj_step(model, data)
        if tick % ROWS == 0:
            position[tick // ROWS], torque[tick // ROWS] = at, float(data.actuator_force[0])
    told: dict[str, Array] = {"position": position, "torque": torque, "position_demand": demand}
    axes = {AXIS: {"joint": "turn", "actuator": "motor"}}
    info = RecordingInfo.model_validate({"machine": "turn", "sample_period": PERIOD, "axes": axes})
    return Recording("swings", info, time, {AXIS: {name: told[name] for name in columns}})


def diagnosed(model: Path, recording: Recording) -> Diagnosis:
    """The cause is found, whatever else the report says."""
    viscous = PlacedEffect(AXIS, Viscous(TRUE_DAMPING), {"viscous": "N·m·s/rad"})
    return replace(BASE, selected=(viscous,), model_xml=model.read_text(encoding="utf-8"), validation=(recording,))


def test_with_the_cause_the_model_moves_as_the_machine_did(tmp_path: Path) -> None:
    model = write_model(tmp_path)
    found = in_closed_loop(diagnosed(model, measured("position", "torque", "position_demand")), model)
    (replayed,) = found.closed_loop
    runs = replayed.axes[AXIS].runs
    for signal in ("position", "torque", "following_error"):
        before, after = (runs[name].apart[signal].relative for name in ("model", "with_effects"))
        assert after < 0.05 * before, signal
    assert found.notes == BASE.notes


def test_the_report_says_both(tmp_path: Path) -> None:
    model = write_model(tmp_path)
    found = in_closed_loop(diagnosed(model, measured("position", "torque", "position_demand")), model)
    write_diagnosis(found, [model], tmp_path / "out", html=True)
    told = read_report(tmp_path / "out/report.json").closed_loop["swings"][AXIS]
    apart = found.closed_loop[0].axes[AXIS].runs["with_effects"].apart["torque"]
    assert told.signals["torque"].with_effects.relative_error == pytest.approx(apart.relative)
    assert "<h2>In closed loop</h2>" in (tmp_path / "out/report.html").read_text(encoding="utf-8")
    console = Console(record=True, width=200)
    print_summary(console, found)
    assert f"{100.0 * apart.relative:.3g} %" in console.export_text()


def test_that_what_was_fitted_is_moved_too_is_said_where_blocks_were_held_back(tmp_path: Path) -> None:
    model = write_model(tmp_path)
    held = replace(diagnosed(model, measured("position", "torque", "position_demand")), held_back=True)
    (note,) = set(in_closed_loop(held, model).notes) - set(BASE.notes)
    assert note.startswith("in closed loop whole recordings are moved")
    nothing = write_model(tmp_path, '<motor name="motor" joint="turn"/>')
    (other,) = set(in_closed_loop(held, nothing).notes) - set(BASE.notes)
    assert other.startswith("not moved in closed loop")


def test_a_recording_without_demand_is_not_moved(tmp_path: Path) -> None:
    model = write_model(tmp_path)
    asked = diagnosed(model, measured("position", "torque"))
    assert in_closed_loop(asked, model) == asked


def test_why_a_demand_could_not_be_followed_is_said(tmp_path: Path) -> None:
    model = write_model(tmp_path, '<motor name="motor" joint="turn"/>')
    found = in_closed_loop(diagnosed(model, measured("position", "torque", "position_demand")), model)
    assert found.closed_loop == ()
    (note,) = set(found.notes) - set(BASE.notes)
    assert note.startswith("not moved in closed loop: ")
    assert "no loop is known" in note
